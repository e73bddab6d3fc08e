"""Activity: what is under way, what has gone wrong, and who hears when either changes."""

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any

from relief.ground.errors import InputError
from relief.ground.formatting import plain

_log = logging.getLogger(__name__)


class Activity:
    """What the app is doing.

    Attributes:
        under_way: what is being computed, a sentence by subject.
        faults: what is wrong, a line by subject.
    """

    def __init__(self) -> None:
        self.under_way: dict[str, str] = {}
        self.faults: dict[str, str] = {}
        self._listeners: list[Callable[[], None]] = []
        self._tasks: set[asyncio.Task[Any]] = set()

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function after every change; returns the function that ends this."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener) if listener in self._listeners else None

    def notify(self) -> None:
        """Call the listeners: something has changed."""
        for listener in list(self._listeners):
            try:
                listener()
            except Exception as error:
                # The other windows are to hear of the change all the same.
                _log.exception("a window could not be brought up to date")
                self.faults["kept"] = f"{type(error).__name__}: {error}"

    @property
    def idle(self) -> bool:
        """Whether nothing is under way."""
        return not (self.under_way or self._tasks)

    def in_background(self, work: Coroutine[Any, Any, Any]) -> asyncio.Task[Any]:
        """Let a computation go on by itself."""
        task = asyncio.ensure_future(work)
        # The loop itself keeps weak references only.
        self._tasks.add(task)
        task.add_done_callback(self._over)
        return task

    def _over(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("a computation for the page has failed", exc_info=task.exception())
            self.faults["kept"] = f"{type(task.exception()).__name__}: {task.exception()}"
            self.notify()

    def fail(self, subject: str, error: Exception) -> None:
        """Keep an error as the fault of a subject."""
        expected = isinstance(error, InputError | OSError | ArithmeticError)
        if not isinstance(error, InputError):
            _log.error("%s", subject, exc_info=error)
        # Names of files may hold what no page can show.
        self.faults[subject] = plain(str(error) if expected else f"{type(error).__name__}: {error}")

    async def step(self, subject: str, doing: str, work: Coroutine[Any, Any, None]) -> None:
        """Do what a person has asked for, unless the subject is under way; an error is its fault.

        Args:
            subject: name of the work.
            doing: the sentence that is shown while the work goes on.
            work: the work.
        """
        if subject in self.under_way:
            work.close()
            return
        self.under_way[subject] = doing
        self.notify()
        try:
            await work
            self.faults.pop(subject, None)
        except Exception as error:
            self.fail(subject, error)
        finally:
            self.under_way.pop(subject, None)
            self.notify()
