"""A module run as by `python -m`, with the CPU seconds of touch in it: contact, its gradient and V.

python -m benchmarks.shared.touch_clock FILE MODULE [ARGUMENT ...]     # writes the seconds into FILE

Stages of `relief.ground.progress` are counted by their names, which earlier versions of Retouch have as well:
called by its path in the folder of a version, this file takes the code there, and nothing of this tree.
"""

import json
import os
import runpy
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import Any

TOUCH = {
    *("pressing", "gradient of the touch", "measuring roughness"),
    *("pressing on places", "pressing with other fingers"),
}
"""Stages that take a time for each place of the finger."""
PROGRESS = ("relief/ground/progress.py", "relief/common/progress.py", "relief/progress.py")
"""Where versions of Retouch have the stages, the latest first."""


class Clock:
    """CPU seconds of the process while any thread is within a stage of touch.

    Attributes:
        seconds: so far.
    """

    def __init__(self) -> None:
        self.seconds = 0.0
        self._lock, self._within, self._began = Lock(), 0, 0.0

    @contextmanager
    def running(self) -> Iterator[None]:
        """A stage of touch, which may lie within another or beside one."""
        with self._lock:
            if not self._within:
                self._began = time.process_time()
            self._within += 1
        try:
            yield
        finally:
            with self._lock:
                self._within -= 1
                if not self._within:
                    self.seconds += time.process_time() - self._began


def counting(progress: Any) -> Clock:
    """Let the stages of a module run a clock."""
    clock, plain = Clock(), progress.stage

    @contextmanager
    def stage(name: str, *arguments: Any, **named: Any) -> Iterator[Any]:
        with clock.running() if name in TOUCH else nullcontext(), plain(name, *arguments, **named) as this:
            yield this

    progress.stage = stage
    return clock


def main() -> None:
    file, module, *arguments = sys.argv[1:]
    # As `python -m` has it: the code of the working directory, not of the folder of this file.
    sys.path[0] = os.getcwd()
    # By files: an editable installation would find modules of another version beside those of this folder.
    (name, *_) = (name for name in PROGRESS if Path(name).is_file())
    clock = counting(import_module(name.removesuffix(".py").replace("/", ".")))
    sys.argv = [module, *arguments]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    finally:
        Path(file).write_text(json.dumps(clock.seconds), encoding="utf-8")


if __name__ == "__main__":
    main()
