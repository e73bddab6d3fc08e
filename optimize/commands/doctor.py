"""`retouch doctor`: checks of the machine (`optimize.commands.diagnosis`)."""

import argparse

HELP = "check this machine, and say what to install"
DESCRIPTION = "Checks everything an optimisation uses: packages, libLLVM, Mitsuba's variants, cache, memory."
EPILOG = """\
example:
  retouch doctor

exit status: 0 if an optimisation can run here, 1 if not.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


def run(arguments: argparse.Namespace) -> int:
    from optimize.commands import diagnosis

    return diagnosis.run(arguments.json)
