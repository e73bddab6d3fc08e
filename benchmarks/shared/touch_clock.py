"""A module run as by `python -m`, with the CPU seconds of touch in it: contact, its gradient and V.

python -m benchmarks.shared.touch_clock FILE MODULE [ARGUMENT ...]     # writes the seconds into FILE

Stages of `relief.common.progress` are counted by their names, which earlier versions of Retouch have as well:
called by its path in the folder of a version, this file takes the code there, and nothing of this tree.
"""

import json
import os
import runpy
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

TOUCH = {
    *("pressing", "gradient of the touch", "measuring roughness"),
    *("pressing on places", "pressing with other fingers"),
}
"""Stages that take a time for each place of the finger."""
PROGRESS = ("relief/common/progress.py", "relief/progress.py")
"""Where versions of Retouch have the stages, the latest first."""


def count(progress: Any) -> list[float]:
    """Let a module of stages count: CPU seconds of every outermost stage of touch, as they end."""
    seconds, within, plain = list[float](), list[str](), progress.stage

    @contextmanager
    def stage(name: str, *arguments: Any, **named: Any) -> Iterator[Any]:
        outermost = name in TOUCH and not within
        began = time.process_time()
        if outermost:
            within.append(name)
        try:
            with plain(name, *arguments, **named) as this:
                yield this
        finally:
            if outermost:
                within.clear()
                seconds.append(time.process_time() - began)

    progress.stage = stage
    return seconds


def main() -> None:
    file, module, *arguments = sys.argv[1:]
    # As `python -m` has it: the code of the working directory, not of the folder of this file.
    sys.path[0] = os.getcwd()
    # By files: an editable installation would find modules of another version beside those of this folder.
    (name, *_) = (name for name in PROGRESS if Path(name).is_file())
    seconds = count(import_module(name.removesuffix(".py").replace("/", ".")))
    sys.argv = [module, *arguments]
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    finally:
        Path(file).write_text(json.dumps(sum(seconds)), encoding="utf-8")


if __name__ == "__main__":
    main()
