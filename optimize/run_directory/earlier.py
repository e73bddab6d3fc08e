"""The checkpoint of a run, told from that of an earlier run in the same folder. Imports nothing heavy."""

from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from relief.ground.formats import RUN_CHECKPOINT


class CheckpointStamp(NamedTuple):
    """Which checkpoint a folder holds: every new one is another file."""

    file: int
    written_ns: int


def checkpoint_stamp(run_dir: Path) -> CheckpointStamp | None:
    """The stamp of the checkpoint in a folder; None if there is none."""
    with suppress(OSError):
        stat = (run_dir / RUN_CHECKPOINT).stat()
        return CheckpointStamp(stat.st_ino, stat.st_mtime_ns)
    return None
