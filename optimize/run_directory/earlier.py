"""The checkpoint of a run, told from that of an earlier run in the same folder. Imports nothing heavy."""

import shlex
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


def resume_advice(run_dir: Path, earlier: CheckpointStamp | None = None) -> str:
    """The clause that a run goes on by `retouch resume`; empty without a checkpoint of its own.

    Args:
        run_dir: of the run.
        earlier: stamp of a checkpoint in it that is another run's.
    """
    go_on = checkpoint_stamp(run_dir) not in (None, earlier)
    return f"retouch resume {shlex.quote(str(run_dir))} goes on" if go_on else ""
