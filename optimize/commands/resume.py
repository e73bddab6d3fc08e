"""`retouch resume`: a run goes on from its checkpoint."""

import argparse
from pathlib import Path

from optimize.commands import optimize as cli_optimize

HELP = "go on with a run that was interrupted or ended short"
DESCRIPTION = "Goes on from the checkpoint of a run, with the settings in its run.toml."
EPILOG = f"""\
example:
  retouch resume runs/stone

{cli_optimize.STATUSES}"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("run_dir", type=Path, metavar="RUN_DIR", help="what retouch optimize -o has written")
    parser.add_argument("-m", dest="variant", metavar="VARIANT", help="Mitsuba's variant")
    parser.add_argument("-q", dest="quiet", action="store_true", help="print nothing but errors")


def run(arguments: argparse.Namespace) -> int:
    from optimize.runs import job

    with cli_optimize.contact_of(arguments.run_dir):
        result = job.resume(arguments.run_dir, variant=arguments.variant, quiet=arguments.quiet)
    return cli_optimize.finish(result, arguments.quiet)
