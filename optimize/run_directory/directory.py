"""The folder of a run: whether it may be written, kept to one run, and cleared of an earlier one."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from optimize.run_directory.finished_run import holds_run
from optimize.run_directory.key import SETTINGS
from optimize.run_directory.results import WRITTEN
from relief.ground.errors import InputError
from relief.ground.files import only_writer, partial_folders, remove_partial


def check_vacant(run_dir: Path, force: bool) -> None:
    """Check that a run may be written into a folder, which need not exist.

    Args:
        run_dir: the folder.
        force: whether an earlier run in it may be replaced.

    Raises:
        InputError: the folder cannot be made or written, holds something that stays, or is being written.
    """
    for path in (run_dir, *run_dir.absolute().parents):
        if path.is_symlink() and not path.exists():
            raise InputError(f"{path}: is a link that leads nowhere")
    existing = next(path for path in (run_dir, *run_dir.absolute().parents) if path.exists())
    if existing != run_dir and not (existing.is_dir() and os.access(existing, os.W_OK)):
        raise InputError(f"{run_dir}: cannot be made; {existing} is not a folder that can be written")
    if run_dir.exists() and not run_dir.is_dir():
        raise InputError(f"{run_dir}: is a file; a run writes a folder")
    if run_dir.exists():
        with beginning_in(run_dir, force):
            pass


@contextmanager
def beginning_in(run_dir: Path, force: bool) -> Iterator[None]:
    """Keep a folder to the run that begins, from before its first file to the end of the block.

    Arguments are as of `check_vacant`, which came first. Raises InputError if another command writes into the
    folder, or if the folder holds something that stays, such as a run that has begun meanwhile.
    """
    with only_writer(run_dir):
        _check_content(run_dir, force)
        yield


def _check_content(run_dir: Path, force: bool) -> None:
    """Raise InputError if a folder holds something that stays."""
    if set(run_dir.iterdir()) <= set(partial_folders(run_dir)):
        return
    if not force:
        fault = f"{run_dir}: holds an earlier run"
        raise InputError(
            f"{fault}; force=True replaces it, or choose another folder",
            f"{fault}; --force replaces it, or choose another -o",
        )
    if not holds_run(run_dir):
        raise InputError(f"{run_dir}: holds files that are not a run's; they are not replaced")


def clear(run_dir: Path) -> None:
    """Take away what an earlier run has left beside run.toml, and nothing else."""
    remove_partial(run_dir)
    for name in WRITTEN:
        path = run_dir / name
        if name == SETTINGS:
            continue
        # A link is taken away, and what it leads to stays.
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
