"""Interrupts: Ctrl-C and a polite kill end work in the same way, after a line for the person.

An exception that breaks into an import leaves a module half loaded. NumPy, torch and Mitsuba then end in
errors of many kinds or by a segmentation fault, or go on as if nothing had come. So a command that imports
ends at once, and an error that follows a signal counts as the interrupt.
"""

import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import NoReturn

INTERRUPTED = 130
"""Exit status of an interrupted command: 128 + SIGINT, as shells count."""
SIGNALS = (signal.SIGINT, signal.SIGTERM)
CLEARED = "\r\x1b[K\x1b[?25h"
"""What ends a moving line on a terminal: the line is emptied, and the cursor is shown again."""

_signals: list[int] = []
"""The signals of this process that a block of `interruptible` has met."""


@contextmanager
def interruptible(
    announce: Callable[[], None] = lambda: None, leave: Callable[[], NoReturn] | None = None
) -> Iterator[Callable[[], bool]]:
    """Let either signal end the block by KeyboardInterrupt, whatever a library makes of that.

    Args:
        announce: called first, at either signal.
        leave: ends the process; called in place of both while the block imports a module.

    Yields:
        Whether a signal has come, when called. If one has and the block ends normally, the block has dealt
        with the interrupt, or a library has lost it.

    Raises:
        KeyboardInterrupt: a signal has come, and the block has ended by an exception.
    """
    start, imports = len(_signals), _imports(sys._getframe())

    def came() -> bool:
        return len(_signals) > start

    def interrupt(number: int, frame: FrameType | None) -> None:
        _signals.append(number)
        if leave is not None and _imports(frame) > imports:
            leave()
        announce()
        raise KeyboardInterrupt

    before = {}
    try:
        for number in SIGNALS:
            # A process in the background of a shell ignores Ctrl-C, and goes on ignoring it.
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, interrupt)
    except ValueError:
        pass  # only the main thread may set handlers
    try:
        yield came
    except Exception as error:
        if came():
            raise KeyboardInterrupt from error
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def leave_interrupted(addition: str = "", stderr: int = 2) -> NoReturn:
    """End the process as interrupted, with the one line that says so.

    Args:
        addition: to the line.
        stderr: descriptor of the stream; Python's own may be in the middle of a line.
    """
    with suppress(OSError):
        os.write(stderr, f"{CLEARED if os.isatty(stderr) else ''}retouch: interrupted{addition}\n".encode())
    os._exit(INTERRUPTED)


def leave_on_signal(status: int) -> None:
    """Let either signal end the process with this status from now on: all is done and printed."""
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda *_: os._exit(status))


def _imports(frame: FrameType | None) -> int:
    """Number of the import system's frames from this one outwards."""
    count = 0
    while frame is not None:
        count += frame.f_code.co_filename.startswith("<frozen importlib")
        frame = frame.f_back
    return count
