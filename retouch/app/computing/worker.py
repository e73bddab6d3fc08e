"""Worker: a process that computes for the page, and that a new one replaces when it dies.

The process ends with the app, and reports what it is doing.
"""

import asyncio
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from multiprocessing.connection import Connection
from typing import ParamSpec, TypeVar

from relief.ground.errors import InputError
from relief.ground.progress import Progress, progress
from retouch.verbs.progress_display import done_of

REPORTED_EVERY_S = 0.25
"""Least time between two lines about what is under way, s."""
NICE = 5
"""Niceness of the worker processes: on few cores the page and the browser come first."""

_open = ExitStack()


def start(reports: Connection) -> None:
    """Prepare the worker process.

    Args:
        reports: takes lines about what is under way, an empty one where nothing is.
    """
    # The terminal's Ctrl-C is for the app, which ends its workers itself.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.nice(NICE)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # Left by no one: the process listens to its own work as long as it lives.
    _open.enter_context(progress(_Reporter(reports)))


def _end_with_parent() -> None:
    """End this process when the app does, however that ends: nobody would hear the results."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(0)


class _Reporter:
    """Sends what is under way, the outermost stage first, a few times a second."""

    def __init__(self, reports: Connection) -> None:
        self._reports, self._stages, self._next = reports, list[Progress](), 0.0

    def __call__(self, now: Progress) -> None:
        self._stages = self._stages[: now.level] + ([] if now.ended else [now])
        if time.monotonic() >= self._next or not self._stages:
            self._next = time.monotonic() + REPORTED_EVERY_S
            self._reports.send(": ".join(one.stage + done_of(one) for one in self._stages))


_log = logging.getLogger(__name__)
P = ParamSpec("P")
T = TypeVar("T")

ATTEMPTS = 2
"""How often a computation is begun before its worker's death is an error: a second death is no accident."""


class Superseded(Exception):
    """A computation whose worker was ended, because its result is wanted no more."""


class Worker:
    """One process, started at its first use. Computations wait for one another.

    Attributes:
        progress: what the process is doing and how far it is; empty if its work reports nothing.
    """

    def __init__(self) -> None:
        self.progress = ""
        self._pool: ProcessPoolExecutor | None = None
        self._reports: Connection | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    def begin(self, function: Callable[P, object], *arguments: P.args, **named: P.kwargs) -> None:
        """Let the process start with a function whose value nobody waits for."""
        self._pool = self._pool or self._new_pool()
        _submitted(self._pool, function, *arguments, **named)

    async def __call__(self, function: Callable[P, T], *arguments: P.args, **named: P.kwargs) -> T:
        """The value of a function of this package.

        Raises:
            InputError: as of the function, or the worker has died twice.
            Superseded: the worker was ended by `close`.
        """
        for _ in range(ATTEMPTS):
            pool = self._pool = self._pool or self._new_pool()
            self._listen()
            try:
                return await asyncio.wrap_future(_submitted(pool, function, *arguments, **named))
            except (BrokenProcessPool, asyncio.CancelledError) as error:
                if self._pool is not pool:
                    raise Superseded from error
                if isinstance(error, asyncio.CancelledError):
                    raise
                _log.warning("the process that computes for the page has died; a new one takes its place")
                self._pool = None
        raise InputError("the process that computes has died twice; there may be too little memory")

    def close(self) -> None:
        """End the process at once: its results are wanted no more."""
        pool, self._pool = self._pool, None
        if pool is None:
            return
        self._hear_no_more()
        for process in list((pool._processes or {}).values()):
            process.kill()
        pool.shutdown(wait=True, cancel_futures=True)

    def _new_pool(self) -> ProcessPoolExecutor:
        # Spawned, as a forked child of a server with threads may hang.
        context = multiprocessing.get_context("spawn")
        self._hear_no_more()
        self._reports, reporting = context.Pipe(duplex=False)
        return ProcessPoolExecutor(1, mp_context=context, initializer=start, initargs=(reporting,))

    def _listen(self) -> None:
        if self._reports is not None and self._loop is None:
            self._loop = asyncio.get_running_loop()
            self._loop.add_reader(self._reports.fileno(), self._hear)

    def _hear(self) -> None:
        try:
            while self._reports is not None and self._reports.poll():
                self.progress = str(self._reports.recv())
        except (EOFError, OSError):
            self._hear_no_more()

    def _hear_no_more(self) -> None:
        self.progress = ""
        if self._reports is not None:
            if self._loop is not None and not self._loop.is_closed():
                self._loop.remove_reader(self._reports.fileno())
            self._reports.close()
        self._reports = self._loop = None


def _submitted(
    pool: ProcessPoolExecutor, function: Callable[P, T], *arguments: P.args, **named: P.kwargs
) -> Future[T]:
    """Submit a computation to the one process of a pool."""
    future = pool.submit(function, *arguments, **named)
    # A process that is killed while it sends a result leaves a part of the result in the pipe. The pool waits
    # for the rest as long as anybody can write, as this process can, although it never does.
    pool._result_queue._writer.close()  # type: ignore[attr-defined]
    return future
