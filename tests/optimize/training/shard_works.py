"""Works for workers of tests, in a module that other processes can import."""

import os
import signal
import time
from pathlib import Path

from optimize.training.shard_jobs import Task, run_shard

MARKED = 1
"""Number of the shard that something happens to."""


def dies_once(task: Task, mark: Path) -> bytes:
    """Takes its process down on the first try of the marked shard."""
    if task.number == MARKED and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return run_shard(task)


def dies_always(task: Task) -> bytes:
    """Takes its process down on the marked shard."""
    if task.number == MARKED:
        os.kill(os.getpid(), signal.SIGKILL)
    return run_shard(task)


def is_mistaken(task: Task) -> bytes:
    """Fails as only a mistake of the program does."""
    raise ZeroDivisionError(task.number)


def slow(task: Task) -> bytes:
    """Takes long enough to be caught at it."""
    time.sleep(0.5)
    return run_shard(task)
