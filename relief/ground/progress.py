"""Progress of long work: deep code names its stages, and a listener gets reports of how far they are.

    with stage("finite elements", total=4) as advance:
        for block in blocks:
            build(block)
            advance()

Stages lie within one another. Without a listener, a stage costs 3 microseconds.
"""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import Protocol, SupportsFloat

INTERVAL_S = 0.1
"""Least time between two reports of one stage, s: as often as a person can read."""


@dataclass(frozen=True)
class Progress:
    """A report of how far a stage is.

    Attributes:
        stage: name of the work, in words.
        done: amount of work that is done, in the unit of `total`.
        total: amount of work of the whole stage; None if unknown.
        seconds: time since the stage began.
        level: 0 for an outermost stage, 1 for a stage within that stage, and so on.
        detail: line about the last step, empty if there is none.
        at_most: whether the stage may end before its total.
        ended: whether the stage is over, finished or given up.
    """

    stage: str
    done: float = 0.0
    total: float | None = None
    seconds: float = 0.0
    level: int = 0
    detail: str = ""
    at_most: bool = False
    ended: bool = False

    @property
    def fraction(self) -> float | None:
        """Share that is done, 0 to 1; None if unknown."""
        if self.total is None or self.at_most:
            return None
        return min(1.0, self.done / self.total) if self.total > 0.0 else 1.0

    @property
    def remaining(self) -> float | None:
        """Seconds that all remaining steps take at the pace so far; None if unknown."""
        if self.total is None or self.done <= 0.0:
            return None
        return self.seconds * max(0.0, self.total / self.done - 1.0)


class Listener(Protocol):
    """Receiver of reports; the thread that works calls its methods."""

    def report(self, progress: Progress) -> None:
        """Called when a stage begins and ends, and at intervals between."""

    def say(self, line: str) -> None:
        """Called with a line for a person, which stays on the screen."""


class Stage:
    """A stage under way; a call of the stage reports that a step is done."""

    def __init__(self, listener: Listener | None, progress: Progress) -> None:
        self._listener, self._progress = listener, progress
        self._began = self._reported = time.perf_counter()
        self._done = self._first = 0.0
        self._report()

    def __call__(self, steps: float = 1.0) -> None:
        if self._listener is not None:
            self.reach(self._done + steps)

    def reach(self, done: float) -> None:
        """Report how much is done in all; less than before is ignored."""
        if self._listener is not None and done > self._done:
            self._done = done
            if time.perf_counter() - self._reported >= INTERVAL_S:
                self._report()

    def residual_at(self, over: SupportsFloat, least: float = 0.0) -> None:
        """Report a residual: done is the share of its digits that are gained, from 0 to a total of 1.

        Args:
            over: residual in units of its tolerance.
            least: lower bound of what is done.
        """
        if self._listener is not None:
            now = max(1.0, float(over))
            self._first = self._first or now
            gained = 1.0 - math.log(now) / math.log(self._first) if 1.0 < self._first < math.inf else 0.0
            self.reach(max(gained, least))

    def describe(self, line: str) -> None:
        """Report a line about the last step."""
        self._report(detail=line)

    def end(self) -> None:
        """Report that the stage is over."""
        self._report(ended=True)

    def _report(self, **changes: str | bool) -> None:
        if self._listener is not None:
            self._reported = time.perf_counter()
            seconds = self._reported - self._began
            self._progress = replace(self._progress, done=self._done, seconds=seconds, **changes)  # type: ignore[arg-type]
            self._listener.report(self._progress)


_NULL_STAGE = Stage(None, Progress(""))
_listener: ContextVar[Listener | None] = ContextVar("listener", default=None)
_stages: ContextVar[tuple[Stage, ...]] = ContextVar("stages", default=())


@contextmanager
def stage(name: str, total: float | None = None, *, at_most: bool = False) -> Iterator[Stage]:
    """A stage of the block, or of the decorated function.

    Args:
        name: name of the work, in words that begin in lower case.
        total: number of steps, or any other measure of the whole; None if unknown.
        at_most: whether the stage may end before its total.
    """
    listener = _listener.get()
    if listener is None:
        yield _NULL_STAGE
        return
    outer = _stages.get()
    this = Stage(listener, Progress(name, total=total, level=len(outer), at_most=at_most))
    before = _stages.set((*outer, this))
    try:
        yield this
    finally:
        _stages.reset(before)
        this.end()


def this_stage() -> Stage:
    """The innermost stage; without a listener, a null stage, which reports nothing."""
    return (_stages.get() or (_NULL_STAGE,))[-1]


def say(line: str) -> None:
    """Report a line for a person, which stays on the screen."""
    if (listener := _listener.get()) is not None:
        listener.say(line)


def has_listener() -> bool:
    """Whether there is a listener."""
    return _listener.get() is not None


@contextmanager
def listening(listener: Listener | None) -> Iterator[None]:
    """Report the stages of the block to a listener, in place of any other; None: to none."""
    before, stages = _listener.set(listener), _stages.set(())
    try:
        yield
    finally:
        _stages.reset(stages)
        _listener.reset(before)


@contextmanager
def progress(callback: Callable[[Progress], None]) -> Iterator[None]:
    """Call a function with the progress of the block's stages.

    The function is called when a stage begins and ends, at most ten times a second between, and by the thread
    that works: what takes long there delays the work, and an error there ends the work. A line for a person,
    such as that of an interrupt, comes as a stage that has ended.
    """
    with listening(_Callback(callback)):
        yield


class _Callback:
    """Listener that calls one function."""

    def __init__(self, callback: Callable[[Progress], None]) -> None:
        self.report = callback

    def say(self, line: str) -> None:
        self.report(Progress(line, ended=True))
