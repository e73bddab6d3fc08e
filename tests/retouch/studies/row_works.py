"""Works for workers of tests, in a module that other processes can import."""

import os
import signal
import threading
import time
from pathlib import Path

from optimize.run_directory.results import HISTORY
from retouch.studies.row_job import RowJob, run_row

STEPS = 2
"""Steps of a row after which its worker dies."""


def dies_once(job: RowJob, mark: Path) -> bytes | str:
    """Takes its process down in the midst of the first row."""
    if job.number == 0 and not mark.exists():
        mark.touch()
        threading.Thread(target=_kill, args=(job.folder / HISTORY,), daemon=True).start()
    return run_row(job)


def _kill(history: Path) -> None:
    while not (history.is_file() and history.read_bytes().count(b"\n") > STEPS):
        time.sleep(0.005)
    os.kill(os.getpid(), signal.SIGKILL)
