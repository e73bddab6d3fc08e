"""Interrupts: Ctrl-C and a polite kill end work in the same way, after a person was told."""

import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interruptible(announce: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Let SIGTERM raise KeyboardInterrupt in the block, as Ctrl-C does.

    Args:
        announce: called first, at either signal.
    """

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        announce()
        raise KeyboardInterrupt

    before = {}
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            # A process in the background of a shell ignores Ctrl-C, and goes on ignoring it.
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, interrupt)
    except ValueError:
        pass  # only the main thread may set handlers
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
