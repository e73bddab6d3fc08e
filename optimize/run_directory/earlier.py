"""The checkpoint of a run, told from that of an earlier run in the same folder. Imports nothing heavy."""

from contextlib import suppress
from pathlib import Path

from relief.ground.formats import RUN_CHECKPOINT

CheckpointStamp = tuple[int, int]
"""Number of a file and ns when it was written: every new checkpoint is another file."""


def checkpoint_stamp(run_dir: Path) -> CheckpointStamp | None:
    """The stamp of the checkpoint in a folder; None if there is none."""
    with suppress(OSError):
        stat = (run_dir / RUN_CHECKPOINT).stat()
        return stat.st_ino, stat.st_mtime_ns
    return None
