"""Processes of this machine that run jobs; a process that dies loses no job."""

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from types import ModuleType
from typing import Any

from relief.ground.errors import InputError
from relief.ground.progress import Progress, listening
from retouch.laboratory.workers.jobs import GIVEN_UP, TRIES, AnyJob, JobResult, JobResults, Work, WorkerError

SINGLE_THREADED = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Environment of workers: one thread each, and the same order of sums on every machine."""


@dataclass
class _WorkerProcess:
    """A process and its current job, None while it is idle."""

    process: multiprocessing.process.BaseProcess
    connection: Connection
    job: Any = None

    def stop(self) -> None:
        self.connection.close()
        # Not politely: a run would measure and write its best relief first, and every file appears whole.
        self.process.kill()
        self.process.join()


def run_here(
    jobs: Iterable[AnyJob],
    workers: int,
    work: Work,
    observer: Callable[[AnyJob, str], None] = lambda job, name: None,
) -> JobResults[AnyJob]:
    """Run jobs in processes of this machine.

    A process has one job at a time, so that the job of a process that dies is known.

    Args:
        jobs: The jobs.
        workers: Number of processes.
        work: What the processes do.
        observer: Called with a job and the name of the outermost stage that its worker has begun.

    Yields:
        The results, in any order.

    Raises:
        InputError: A worker raised one.
        OSError: A worker raised one, as of a full disk.
        WorkerError: A worker raised any other error.
    """
    pending, retries = iter(jobs), list[AnyJob]()
    deaths: dict[int, int] = {}
    pool: list[_WorkerProcess] = []
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
                if isinstance(answer, _StageBegun):
                    observer(job, answer.name)
                    continue
                worker.job = None
                if isinstance(answer, Exception):
                    raise answer
                yield JobResult(job, answer)
    finally:
        for worker in pool:
            worker.stop()


def _start_worker(work: Work) -> _WorkerProcess:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs, work), daemon=True)
    with _environment(SINGLE_THREADED), _ignore_interrupts(), _without_the_script():
        process.start()
    # While this end is open here, the connection would outlive the process.
    theirs.close()
    return _WorkerProcess(process, ours)


def _send_job(worker: _WorkerProcess) -> None:
    # A worker that has died is noticed when its answer is awaited.
    with suppress(OSError):
        worker.connection.send(worker.job)


@dataclass(frozen=True)
class _StageBegun:
    """News of a worker: the stage that it has begun."""

    name: str


class _Reporter:
    """Listener that sends the names of outermost stages."""

    def __init__(self, connection: Connection) -> None:
        self._connection, self._name = connection, ""

    def report(self, progress: Progress) -> None:
        if progress.level == 0 and not progress.ended and progress.stage != self._name:
            self._name = progress.stage
            self._connection.send(_StageBegun(self._name))

    def say(self, line: str) -> None:
        """Lines for a person stay here: several workers would talk at once."""


def _serve(connection: Connection, work: Work) -> None:
    """Receive jobs and send what the work returns, until the other end of the connection is closed."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    while True:
        try:
            job = connection.recv()
        except EOFError:
            return
        answer: bytes | str | Exception
        try:
            with listening(_Reporter(connection)):
                answer = work(job)
        except InputError as error:
            answer = InputError(str(error))
        except OSError as error:
            answer = OSError(error.errno, error.strerror, error.filename)
            if error.errno is None:
                answer = WorkerError(traceback.format_exc())
        except Exception:  # sent to the process that can show the traceback
            answer = WorkerError(traceback.format_exc())
        connection.send(answer)


def _end_with_parent() -> None:
    """End this process when its parent dies: an orphan would write beside the next worker of its job."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


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
def _without_the_script() -> Iterator[None]:
    """Start processes that do not import the caller's script, which would run again without a guard."""
    script = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


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
