"""Work for a worker of tests, in a module that another process can import."""

import time
from pathlib import Path


def until_there(begun: Path, end: Path) -> None:
    """Makes one file when it begins, and ends once the other is there."""
    begun.touch()
    while not end.exists():
        time.sleep(0.01)
