"""`retouch resume`: a run continued from its checkpoint."""

import argparse
from pathlib import Path

from optimize.commands.optimize import STATUSES, finish
from optimize.commands.options import add_variant, contact_errors_name
from relief.errors import InputError

HELP = "continue a run that was interrupted or ended short of its target"
DESCRIPTION = "Continues a run from its checkpoint, with the settings in its run.toml."
EPILOG = f"""\
example:
  retouch resume runs/stone

{STATUSES}"""


AFTER_INTERRUPT = "; retouch resume RUN_DIR goes on"
"""End of the line that an interrupt prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "run_dir", type=Path, metavar="RUN_DIR", help="folder that retouch optimize has written"
    )
    add_variant(parser)
    parser.add_argument("-q", dest="quiet", action="store_true", help="print nothing but errors")


def run(arguments: argparse.Namespace) -> int:
    if not arguments.run_dir.is_dir():
        raise InputError(f"{arguments.run_dir}: no such file or folder")
    from optimize.runs import job

    with contact_errors_name(arguments.run_dir):
        result = job.resume(arguments.run_dir, variant=arguments.variant, quiet=arguments.quiet)
    return finish(result, arguments.quiet)
