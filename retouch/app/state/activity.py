"""Activity: what is under way, what has gone wrong, and who is told when either changes."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine
from typing import Any

from relief.ground.errors import InputError

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

    def tell(self) -> None:
        """Tell the listeners that something has changed."""
        for listener in list(self._listeners):
            try:
                listener()
            except Exception as error:
                # The other windows are to hear of it all the same.
                _log.exception("a window could not be brought up to date")
                self.faults["kept"] = f"{type(error).__name__}: {error}"

    @property
    def idle(self) -> bool:
        """Whether nothing is under way."""
        return not (self.under_way or self._tasks)

    def in_background(self, work: Coroutine[Any, Any, Any]) -> None:
        """Let a computation go on by itself."""
        task = asyncio.ensure_future(work)
        # The loop itself keeps weak references only.
        self._tasks.add(task)
        task.add_done_callback(self._over)

    def _over(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and task.exception() is not None:
            _log.error("a computation for the page has failed", exc_info=task.exception())
            self.faults["kept"] = f"{type(task.exception()).__name__}: {task.exception()}"
            self.tell()

    async def guarded(self, subject: str, work: Awaitable[None]) -> None:
        """Do work whose failure is a line about the subject."""
        try:
            await work
        except (InputError, OSError, ArithmeticError) as error:
            self.faults[subject] = str(error)
        except Exception as error:
            # Of the models: a contact that does not converge, for one.
            _log.info("%s", subject, exc_info=error)
            self.faults[subject] = f"{type(error).__name__}: {error}"
        else:
            self.faults.pop(subject, None)

    async def step(self, subject: str, told: str, work: Coroutine[Any, Any, None]) -> None:
        """Do what a person has asked for, told while it goes on; a failure is a fault of the subject."""
        if subject in self.under_way:
            work.close()
            return
        self.under_way[subject] = told
        self.tell()
        try:
            await self.guarded(subject, work)
        finally:
            self.under_way.pop(subject, None)
            self.tell()
