"""Works for workers of tests, in a module that other processes can import."""

import os
import signal
import time
from pathlib import Path

from retouch.laboratory.training.shard_jobs import ShardJob, run_shard

MARKED = 1
"""Number of the shard that something happens to."""


def dies_once(job: ShardJob, mark: Path) -> bytes:
    """Takes its process down on the first try of the marked shard."""
    if job.number == MARKED and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return run_shard(job)


def dies_always(job: ShardJob) -> bytes:
    """Takes its process down on the marked shard."""
    if job.number == MARKED:
        os.kill(os.getpid(), signal.SIGKILL)
    return run_shard(job)


def is_mistaken(job: ShardJob) -> bytes:
    """Fails as only a mistake of the program does."""
    raise ZeroDivisionError(job.number)


def slow(job: ShardJob) -> bytes:
    """Takes long enough to be caught at it."""
    time.sleep(0.5)
    return run_shard(job)
