"""The choice of a runner, as the options of the command name it."""

import os
from collections.abc import Callable
from functools import partial
from typing import Any

from retouch.laboratory.workers.cluster import run_on_dask
from retouch.laboratory.workers.jobs import Runner, Work
from retouch.laboratory.workers.processes import run_here


def runner(
    work: Work,
    workers: int | None = None,
    dask: str | None = None,
    observer: Callable[[Any, str], None] = lambda job, name: None,
) -> Runner:
    """The runner of some work.

    Args:
        work: What the workers do.
        workers: Number of processes here; by default one for each core that this process may use.
        dask: Address of a Dask scheduler, or "local"; None for processes without Dask.
        observer: Called with a job and the name of each stage of it that begins; not on a Dask cluster.
    """
    workers = workers or cores()
    if dask is None:
        return partial(run_here, workers=workers, work=work, observer=observer)
    return partial(run_on_dask, address=dask, workers=workers, work=work)


def cores() -> int:
    """The number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
