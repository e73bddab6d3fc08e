"""The code of a commit beside that of this tree, and commands that are run by the code in a folder."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.shared.common import ROOT

NOW = "now"
"""Name of this tree among the versions."""
DEMO_RUNS = [(texture, jnd) for texture in ("gravel", "brick", "grass") for jnd in (-2, 2)]
"""Bundled run and target, JND, of the demo runs."""
MODELS: Mapping[str, Sequence[str]] = {"exact": (), "fast": ("--fast",)}
"""Options of `optimize` by the models that steer."""


@contextmanager
def checkouts(before: str | None) -> Iterator[dict[str, Path]]:
    """Folders of the code by version: of a commit, if one is given, and of this tree."""
    if before is None:
        yield {NOW: ROOT}
        return
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        git = ("git", "-C", str(ROOT), "worktree")
        subprocess.run([*git, "add", "--detach", str(tree), before], check=True, capture_output=True)
        try:
            yield {before: tree, NOW: ROOT}
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=True)


CODE = ("mitsuba_scenes", "optimize", "relief", "retouch", "surrogate", "tactile", "visual")
"""Folders of what a user installs."""


def version_of(folder: Path) -> str:
    """The last commit that has changed the code in a folder, with a "+" where changes are not committed."""
    git = ("git", "-C", str(folder))
    found = [
        subprocess.run([*git, *command, "--", *CODE], check=True, capture_output=True, text=True).stdout
        for command in (("log", "-1", "--format=%h"), ("status", "--porcelain"))
    ]
    return found[0].strip() + "+" * bool(found[1].strip())


def module_of(folder: Path) -> str:
    """The module that is the command `retouch` in a version of the code."""
    return "retouch" if (folder / "retouch" / "__main__.py").is_file() else "optimize"


def process(folder: Path, command: Sequence[str], statuses: Sequence[int] = (0,)) -> dict[str, float]:
    """Wall and CPU seconds and peak memory (MB) of Python with these arguments, in a folder.

    Raises:
        RuntimeError: the exit status is none of `statuses`.
    """
    began = time.perf_counter()
    child = subprocess.Popen([sys.executable, *command], cwd=folder, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode not in statuses:
        raise RuntimeError(f"{' '.join(command)}: exit status {child.returncode}")
    return {
        "wall_s": time.perf_counter() - began,
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "peak_mb": usage.ru_maxrss / 1024.0,
    }
