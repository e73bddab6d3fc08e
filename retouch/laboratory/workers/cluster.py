"""Processes of a Dask cluster that run jobs; a process that dies loses no job."""

import logging
from collections.abc import Iterable
from typing import Any

from relief.ground.errors import InputError
from retouch.laboratory.workers.jobs import AnyJob, JobResult, JobResults, Work

ON_A_LOCAL_CLUSTER = "local"
"""Address that stands for a Dask cluster of processes here."""
WITHOUT_DASK = "dask: the package distributed is missing: pip install 'retouch[dask]'"


def run_on_dask(jobs: Iterable[AnyJob], address: str, workers: int, work: Work) -> JobResults[AnyJob]:
    """Run jobs on a Dask cluster, whose machines need this program, but no files of this machine.

    Args:
        jobs: The jobs.
        address: Address of the scheduler, as in "tcp://10.0.0.1:8786", or "local" for a cluster of processes
            here.
        workers: Number of processes of a local cluster.
        work: What the workers do.

    Yields:
        The results, in any order.

    Raises:
        InputError: No scheduler answers, the package `distributed` is missing, or a worker raised one.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        raise InputError(WITHOUT_DASK) from error
    # Its news of each connection that opens and closes is of no use to whoever waits for results.
    logging.getLogger("distributed").setLevel(logging.ERROR)
    if address == ON_A_LOCAL_CLUSTER:
        with (
            LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None
            ) as cluster,
            Client(cluster) as client,
        ):
            yield from run_on_client(jobs, client, work)
        return
    try:
        client = Client(address)
    except (OSError, ValueError) as error:
        raise InputError(f"dask: {address}: no scheduler answers: {error}") from error
    with client:
        yield from run_on_client(jobs, client, work)


def run_on_client(jobs: Iterable[AnyJob], client: Any, work: Work) -> JobResults[AnyJob]:
    """Run jobs as `run_on_dask` does, on the cluster of a `distributed.Client`."""
    from distributed import KilledWorker, as_completed

    pending = iter(jobs)
    running: dict[Any, AnyJob] = {}
    finished = as_completed()

    def submit_jobs() -> None:
        # Two jobs more than threads: no worker waits for this process, and few results wait in memory.
        room = 2 + sum(client.nthreads().values())
        while len(running) < room:
            job = next(pending, None)
            if job is None:
                return
            future = client.submit(work, job, pure=False)
            running[future] = job
            finished.add(future)

    submit_jobs()
    for future in finished:
        job = running.pop(future)
        try:
            content: bytes | str = future.result()
        except KilledWorker:
            content = "the cluster gave it up: its workers died"
        future.release()
        submit_jobs()
        yield JobResult(job, content)
