"""Workers for shard jobs: processes here or of a Dask cluster; a worker that dies loses no shard."""

import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Protocol

from optimize.training.shard_jobs import ShardJob, run_shard
from relief.errors import InputError

TRIES = 3
"""Most times that a shard is tried when its worker dies."""
SINGLE_THREADED = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Environment of workers: one thread each, and the same order of sums on every machine."""
GIVEN_UP = f"its worker died {TRIES} times"
"""Reason of a shard that is abandoned."""
ON_A_LOCAL_CLUSTER = "local"
"""Address that stands for a Dask cluster of processes here."""
WITHOUT_DASK = "dask: the package distributed is missing: pip install 'retouch[dask]'"

Work = Callable[[ShardJob], bytes]
"""A function that computes the content of a shard's file."""


@dataclass(frozen=True)
class JobResult:
    """Result of a job.

    Attributes:
        job: The job.
        content: Content of the shard's file, or one line that says why the shard is abandoned.
    """

    job: ShardJob
    content: bytes | str


JobResults = Generator[JobResult, None, None]
"""Results in any order; closing the generator ends the workers."""


class Runner(Protocol):
    """Runner of jobs."""

    def __call__(self, jobs: Iterable[ShardJob]) -> JobResults:
        """Run jobs and yield their results in any order, each job exactly once."""


class WorkerError(RuntimeError):
    """An error of the program in a worker; the message is the worker's traceback."""


@dataclass
class _Worker:
    """A process and its current job, None while it is idle."""

    process: multiprocessing.process.BaseProcess
    connection: Connection
    job: ShardJob | None = None

    def stop(self) -> None:
        self.connection.close()
        self.process.terminate()
        self.process.join()


def run_here(jobs: Iterable[ShardJob], workers: int, work: Work = run_shard) -> JobResults:
    """Run jobs in processes of this machine.

    A process has one job at a time, so that the job of a process that dies is known.

    Args:
        jobs: The jobs.
        workers: Number of processes.
        work: What the processes do.

    Yields:
        The results, in any order.

    Raises:
        InputError: A worker raised one.
        WorkerError: A worker raised any other error.
    """
    pending, retries = iter(jobs), list[ShardJob]()
    deaths: dict[int, int] = {}
    pool: list[_Worker] = []
    try:
        while True:
            while sum(worker.job is not None for worker in pool) < workers:
                job = retries.pop() if retries else next(pending, None)
                if job is None:
                    break
                idle = next((worker for worker in pool if worker.job is None), None)
                if idle is None:
                    idle = _start_worker(work)
                    pool.append(idle)
                idle.job = job
                _send_job(idle)
            busy = {worker.connection: worker for worker in pool if worker.job is not None}
            if not busy:
                return
            for ready in wait(list(busy)):
                worker = busy[ready]  # type: ignore[index]  # one of the connections in `busy`
                job = worker.job
                assert job is not None
                try:
                    answer = worker.connection.recv()
                except (EOFError, OSError):
                    pool.remove(worker)
                    worker.stop()
                    deaths[job.number] = deaths.get(job.number, 0) + 1
                    if deaths[job.number] < TRIES:
                        retries.append(job)
                    else:
                        yield JobResult(job, GIVEN_UP)
                    continue
                worker.job = None
                if isinstance(answer, Exception):
                    raise answer
                yield JobResult(job, answer)
    finally:
        for worker in pool:
            worker.stop()


def _start_worker(work: Work) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, work), daemon=True)
    with _environment(SINGLE_THREADED), _ignore_interrupts():
        process.start()
    # While this end is open here, the connection would outlive the process.
    theirs.close()
    return _Worker(process, ours)


def _send_job(worker: _Worker) -> None:
    # A worker that has died is noticed when its answer is awaited.
    with suppress(OSError):
        worker.connection.send(worker.job)


def _serve(connection: Connection, work: Work) -> None:
    """Receive jobs and send shards until the other end of the connection is closed."""
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        answer: bytes | Exception
        try:
            answer = work(job)
        except InputError as error:
            answer = InputError(str(error))
        except Exception:  # sent to the process that can show the traceback
            answer = WorkerError(traceback.format_exc())
        connection.send(answer)


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables, which processes started in the block inherit."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@contextmanager
def _ignore_interrupts() -> Iterator[None]:
    """Let processes started in the block ignore Ctrl-C, which a terminal sends to all processes."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def run_on_dask(jobs: Iterable[ShardJob], address: str, workers: int, work: Work = run_shard) -> JobResults:
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


def run_on_client(jobs: Iterable[ShardJob], client: Any, work: Work = run_shard) -> JobResults:
    """Run jobs as `run_on_dask` does, on the cluster of a `distributed.Client`."""
    from distributed import KilledWorker, as_completed

    pending = iter(jobs)
    running: dict[Any, ShardJob] = {}
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
