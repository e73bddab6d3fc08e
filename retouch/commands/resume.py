"""`retouch resume`: continue a run that was interrupted or ended short of its target.

Continues a run from its checkpoint, with the settings in its run.toml. A run that has ended is not computed
again: its summary is printed at once.

example:
  retouch resume runs/stone

{STATUSES}
"""

import argparse
import sys
from pathlib import Path

import retouch
from relief.ground.errors import InputError
from retouch.commands.optimize import STATUSES as STATUSES
from retouch.commands.optimize import finish, how_to_go_on
from retouch.commands.options import add, add_talk, add_variant, contact_errors_name

NOTHING_LEFT = (
    "{run_dir}: this run has ended, and resuming it would change nothing. "
    "To go further, raise descent.steps or verify.corrections in its run.toml."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add(parser, "run_dir RUN_DIR", "folder that retouch optimize has written", type=Path)
    add_variant(parser)
    add_talk(parser, "the content of result.json, with the files of the run,")


def after_interrupt(arguments: argparse.Namespace) -> str:
    """End of the line that an interrupt prints."""
    return how_to_go_on(arguments.run_dir)


def run(arguments: argparse.Namespace) -> int:
    if not arguments.run_dir.is_dir():
        raise InputError(f"{arguments.run_dir}: no such file or folder")
    if (status := _finished(arguments)) is not None:
        return status
    with contact_errors_name(arguments.run_dir):
        result = retouch.resume(arguments.run_dir, variant=arguments.variant, quiet=arguments.quiet)
    return finish(result.verification, result.run_dir, arguments)


def _finished(arguments: argparse.Namespace) -> int | None:
    """Say so if the run is finished; returns its exit status, or None if there is something left to do."""
    from optimize.run_directory.finished_run import finished

    result = finished(arguments.run_dir)
    if result is None:
        return None
    try:
        status = finish(result, arguments.run_dir, arguments)
    except (LookupError, TypeError, ValueError, AttributeError):
        # Not what a run writes: resuming writes it anew.
        return None
    if not arguments.quiet:
        print(NOTHING_LEFT.format(run_dir=arguments.run_dir), file=sys.stderr)
    return status
