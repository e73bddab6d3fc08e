"""`retouch doctor`: the arguments of `optimize.commands.diagnosis`."""

import argparse

HELP = "tell what this machine has, and what to do about what is missing"
DESCRIPTION = "Looks at what an optimisation uses: packages, libLLVM, Mitsuba's variants, caches, memory."
EPILOG = """\
example:
  retouch doctor

exit status: 0 if an optimisation can run here, 1 if not.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")


def run(arguments: argparse.Namespace) -> int:
    from optimize.commands import diagnosis as doctor

    return doctor.run(arguments.json)
