"""The worker process: it ends with the app, and reports what it is doing."""

import multiprocessing
import os
import signal
import threading
import time
from contextlib import ExitStack
from multiprocessing.connection import Connection

from relief.ground.progress import Progress, progress

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
            self._reports.send(": ".join(map(_sentence, self._stages)))


def _sentence(stage: Progress) -> str:
    if stage.at_most and stage.total is not None and stage.done:
        return f"{stage.stage}, {stage.done:g} of at most {stage.total:g}"
    return f"{stage.stage}, {100.0 * stage.fraction:.0f} %" if stage.fraction else stage.stage
