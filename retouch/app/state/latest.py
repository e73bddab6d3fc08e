"""Latest: the answer for a key that may change while the answer is being computed."""

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from retouch.app.computing.worker import Superseded
from retouch.app.state.activity import Activity

Key = TypeVar("Key")
Answer = TypeVar("Answer")


@dataclass(eq=False)
class Latest(Generic[Key, Answer]):
    """The answer for the latest key, computed by one piece of work at a time.

    While work is under way, keys may come and go: the latest one is computed next, the others never. An
    answer is kept if its topic is still the wanted one, and an error only if its key is.

    Attributes:
        activity: lists the work under way, and keeps its errors.
        subject: name of the work in `activity`.
        work: computes the answer for a key.
        stop: ends the work under way, which then raises `Superseded`; None: outdated work runs to its end, or
            to its next `check`.
        key: that is wanted; None for none.
        answer: for the wanted key, or for an earlier one of its topic; None until there is one.
    """

    activity: Activity
    subject: str
    work: Callable[[Key], Awaitable[Answer]]
    stop: Callable[[], None] | None = None
    key: Key | None = field(default=None, init=False)
    answer: Answer | None = field(default=None, init=False)
    _topic: object = field(default=None, init=False)
    _doing: str = field(default="", init=False)
    _computed: Key | None = field(default=None, init=False)
    _task: asyncio.Task[Any] | None = field(default=None, init=False)

    @property
    def busy(self) -> bool:
        """Whether work is under way."""
        return self._task is not None and not self._task.done()

    def want(self, key: Key | None, doing: str = "", topic: object = None) -> None:
        """Ask for the answer for a key; nothing happens if key and topic are wanted already.

        Args:
            key: None if no answer is wanted any more.
            doing: what `activity` says is under way; empty for work that is not shown.
            topic: what the key is about: an earlier answer about the same topic stays until the next one
                comes. None: the key itself.
        """
        topic = key if topic is None else topic
        if key == self.key and topic == self._topic:
            return
        if topic != self._topic:
            self.answer = None
            self.activity.faults.pop(self.subject, None)
        self.key, self._topic, self._doing = key, topic, doing
        if not self.busy:
            if key is not None:
                self._task = self.activity.in_background(self._follow())
        elif self.stop is not None:
            # Whatever is being computed is lost, even if its key is wanted again before the work has ended.
            self._computed = None
            self.stop()

    def check(self) -> None:
        """Let outdated work end: raises Superseded if another key is wanted than the one being computed."""
        if self.key != self._computed:
            raise Superseded

    async def finished(self) -> None:
        """Wait until no work is under way."""
        if self._task is not None:
            await asyncio.wait([self._task])

    async def _follow(self) -> None:
        self._computed = None
        try:
            while self.key is not None and self.key != self._computed:
                await self._compute(self.key, self._topic)
        finally:
            # Before the listeners, who may want the next key.
            self._task = None
            self.activity.under_way.pop(self.subject, None)
            self.activity.notify()

    async def _compute(self, key: Key, topic: object) -> None:
        self._computed = key
        if self._doing:
            self.activity.under_way[self.subject] = self._doing
        self.activity.notify()
        try:
            answer = await self.work(key)
        except Superseded:
            return
        except Exception as error:
            if key == self.key:
                self.activity.fail(self.subject, error)
            return
        if topic == self._topic:
            self.answer = answer
        if key == self.key:
            self.activity.faults.pop(self.subject, None)
