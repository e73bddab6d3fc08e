"""`retouch doctor`: checks of the machine (`retouch.commands.diagnosis`)."""

import argparse

from retouch.commands.options import add_talk

HELP = "check this machine, and say what to install"
DESCRIPTION = "Checks everything an optimisation uses: packages, libLLVM, Mitsuba's variants, cache, memory."
EPILOG = """\
example:
  retouch doctor

exit status: 0 if an optimisation can run here, 1 if not.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_talk(parser, "every finding", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    from retouch.commands import diagnosis

    return diagnosis.run(arguments.json)
