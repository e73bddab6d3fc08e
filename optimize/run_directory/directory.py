"""The folder of a run: whether it may be written, and cleared of an earlier run."""

import os
import shutil
from pathlib import Path

from optimize.run_directory.key import SETTINGS
from optimize.run_directory.results import WRITTEN, holds_run
from relief.common.errors import InputError
from relief.common.files import partial_folders, remove_partial


def check_vacant(run_dir: Path, force: bool) -> None:
    """Check that a run may be written into a folder, which need not exist.

    Args:
        run_dir: the folder.
        force: whether an earlier run in it may be replaced.

    Raises:
        InputError: the folder cannot be made or written, or holds something that stays.
    """
    for path in (run_dir, *run_dir.absolute().parents):
        if path.is_symlink() and not path.exists():
            raise InputError(f"{path}: is a link that leads nowhere")
    existing = next(path for path in (run_dir, *run_dir.absolute().parents) if path.exists())
    if existing != run_dir and not (existing.is_dir() and os.access(existing, os.W_OK)):
        raise InputError(f"{run_dir}: cannot be made; {existing} is not a folder that can be written")
    if run_dir.exists() and not run_dir.is_dir():
        raise InputError(f"{run_dir}: is a file; a run writes a folder")
    if not run_dir.is_dir() or set(run_dir.iterdir()) <= set(partial_folders(run_dir)):
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
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)
