"""Shards done by processes here, or by those of a Dask cluster; a process that dies loses nothing."""

from __future__ import annotations

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
"""Times that a shard may take its worker down."""
SINGLE_THREADED = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Environment of workers: one thread each, and the same order of sums on every machine."""
GIVEN_UP = f"its worker died {TRIES} times"
ON_A_LOCAL_CLUSTER = "local"
WITHOUT_DASK = "--dask: the package distributed is missing: pip install 'retouch[dask]'"

Work = Callable[[ShardJob], bytes]


@dataclass(frozen=True)
class JobResult:
    """A shard that was done or given up: the content of its file, or in a line why there is none."""

    job: ShardJob
    content: bytes | str


Results = Generator[JobResult, None, None]
"""In any order; closing it ends the workers."""


class Runner(Protocol):
    """Does tasks, in any order."""

    def __call__(self, jobs: Iterable[ShardJob]) -> Results: ...


class WorkerError(RuntimeError):
    """A mistake of the program in a worker; holds the worker's traceback."""


@dataclass
class _Worker:
    """A process with what it is at."""

    process: multiprocessing.process.BaseProcess
    connection: Connection
    job: ShardJob | None = None

    def stop(self) -> None:
        self.connection.close()
        self.process.terminate()
        self.process.join()


def run_here(jobs: Iterable[ShardJob], workers: int, work: Work = run_shard) -> Results:
    """Processes of this machine; each has one task at a time, so that it is known which one took it down.

    Raises:
        InputError: a worker did.
        WorkerError: a worker raised anything else.
    """
    todo, again = iter(jobs), list[ShardJob]()
    deaths: dict[int, int] = {}
    crew: list[_Worker] = []
    try:
        while True:
            while sum(worker.job is not None for worker in crew) < workers:
                job = again.pop() if again else next(todo, None)
                if job is None:
                    break
                idle = next((worker for worker in crew if worker.job is None), None)
                if idle is None:
                    idle = _hired(work)
                    crew.append(idle)
                idle.job = job
                _hand_over(idle)
            busy = {worker.connection: worker for worker in crew if worker.job is not None}
            if not busy:
                return
            for ready in wait(list(busy)):
                worker = busy[ready]  # type: ignore[index]  # of the connections asked about
                job = worker.job
                assert job is not None
                try:
                    answer = worker.connection.recv()
                except (EOFError, OSError):
                    crew.remove(worker)
                    worker.stop()
                    deaths[job.number] = deaths.get(job.number, 0) + 1
                    if deaths[job.number] < TRIES:
                        again.append(job)
                    else:
                        yield JobResult(job, GIVEN_UP)
                    continue
                worker.job = None
                if isinstance(answer, Exception):
                    raise answer
                yield JobResult(job, answer)
    finally:
        for worker in crew:
            worker.stop()


def _hired(work: Work) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, work), daemon=True)
    with _environment(SINGLE_THREADED), _deaf_to_interrupts():
        process.start()
    # Or the end of the process would not end the connection.
    theirs.close()
    return _Worker(process, ours)


def _hand_over(worker: _Worker) -> None:
    # If it has died, waiting for its answer tells.
    with suppress(OSError):
        worker.connection.send(worker.job)


def _serve(connection: Connection, work: Work) -> None:
    """The life of a worker: tasks come in, shards go out, until the other end is closed."""
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
        except Exception:  # told to the process that can show it
            answer = WorkerError(traceback.format_exc())
        connection.send(answer)


@contextmanager
def _environment(values: Mapping[str, str]) -> Iterator[None]:
    """These variables, which processes started inside inherit."""
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
def _deaf_to_interrupts() -> Iterator[None]:
    """Processes started inside leave Ctrl-C, which a terminal sends to all, to this one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def run_on_dask(jobs: Iterable[ShardJob], address: str, workers: int, work: Work = run_shard) -> Results:
    """Workers of a Dask cluster; their machines need this program, but no files of this one.

    Args:
        address: of the scheduler, as in "tcp://10.0.0.1:8786"; "local": a cluster of processes here.
        workers: of a local cluster.

    Raises:
        InputError: there is no such cluster, no package `distributed` here, or a worker said so.
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
        raise InputError(f"--dask: {address}: no scheduler answers: {error}") from error
    with client:
        yield from run_on_client(jobs, client, work)


def run_on_client(jobs: Iterable[ShardJob], client: Any, work: Work = run_shard) -> Results:
    """As `run_on_dask`, on the cluster of a `distributed.Client`."""
    from distributed import KilledWorker, as_completed

    todo = iter(jobs)
    doing: dict[Any, ShardJob] = {}
    finished = as_completed()

    def hand_out() -> None:
        # A few more than there are threads: no worker waits for this process, and few results wait for it.
        room = 2 + sum(client.nthreads().values())
        while len(doing) < room:
            job = next(todo, None)
            if job is None:
                return
            future = client.submit(work, job, pure=False)
            doing[future] = job
            finished.add(future)

    hand_out()
    for future in finished:
        job = doing.pop(future)
        try:
            content: bytes | str = future.result()
        except KilledWorker:
            content = "the cluster gave it up: its workers died"
        future.release()
        hand_out()
        yield JobResult(job, content)
