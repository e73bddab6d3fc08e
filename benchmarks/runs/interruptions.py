"""Runs that are killed or meet a full disk, and go on to the result of the uninterrupted one.

python -m benchmarks.runs.interruptions            # every case that is not in the results yet
python -m benchmarks.runs.interruptions --again    # every case

Twenty runs write to a disk that is full after a share of what a run writes (a small tmpfs, which only root
can mount); a hundred are killed (SIGKILL) at moments spread over the life of the run directory. Each is then
followed by what a user would try: `resume`, the same command, the same command with `--force`. The table
counts which of them ended the run, and gives the largest distance of its heights from the uninterrupted ones.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from functools import cache, partial
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.shared.common import ROOT, load, machine, parser_of, save, table
from optimize.run_directory.checkpoint import load_checkpoint
from optimize.run_directory.key import SETTINGS
from relief.heightmap import save_heights_exr

NAME = "interruptions"
KILLS, FULL_DISKS = 100, 20
SAME_MM = 1e-9
"""Largest distance, mm, of heights that count as those of the uninterrupted run."""
LONGEST_S = 300.0
"""Seconds after which a command counts as hanging."""
PAGE = 4096
"""Unit of the size of a tmpfs, bytes."""

Case = Callable[[], dict[str, Any]]
"""A case, which gives its row."""

RUN = """scene = "studio"
texture = "waves.exr"
define.resolution = 32
[touch]
jnd = 2
[descent]
steps = 6
tolerance = 0.002
[verify]
model = "layer"
samples = 16
"""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--jobs", type=int, default=2, help="commands at a time")
    arguments = parser.parse_args()
    rows: dict[str, dict[str, Any]] = load(NAME).get("rows", {})
    lock = Lock()

    def add(name: str, work: Case) -> None:
        row = work()
        with lock:
            rows[name] = row
            save(NAME, {"machine": machine(), "run": RUN, "same_mm": SAME_MM, "rows": rows})
            print(name, row, flush=True)

    with tempfile.TemporaryDirectory() as temporary:
        cases = {
            name: work
            for name, work in of_runs(Path(temporary)).items()
            if arguments.again or name not in rows
        }
        with ThreadPoolExecutor(arguments.jobs) as pool:
            for _ in pool.map(add, cases.keys(), cases.values()):
                pass
    print(summary(rows))


def spread(count: int, seed: int | None = None) -> list[float]:
    """Shares of a whole, evenly spread, in the order of a seed."""
    shares = (np.arange(count) + 0.5) / max(count, 1)
    ordered = shares if seed is None else np.random.default_rng(seed).permutation(shares)
    return [float(share) for share in ordered]


def of_runs(folder: Path) -> dict[str, Case]:
    """The cases of single runs."""
    save_heights_exr(folder / "waves.exr", waves())
    (folder / "run.toml").write_text(RUN)
    at_once = Lock()

    @cache
    def whole() -> tuple[float, int, NDArray[np.float64]]:
        """Seconds and bytes of the uninterrupted run, and its heights."""
        out = folder / "whole"
        began, process = time.perf_counter(), started(folder, out)
        appeared = time_of_settings(process, out) - began
        assert process.wait(LONGEST_S) in (0, 3)
        life = time.perf_counter() - began - appeared
        written = sum(-(-path.stat().st_size // PAGE) * PAGE for path in out.rglob("*") if path.is_file())
        return life, written, load_checkpoint(out).best.heights

    def full_disk(share: float) -> dict[str, Any]:
        with at_once:
            _, written, heights = whole()
        return after_a_full_disk(folder, max(1, round(share * written / PAGE)) * PAGE, heights)

    def kill(share: float) -> dict[str, Any]:
        with at_once:
            life, _, heights = whole()
        return after_a_kill(folder, share * life, heights)

    return {
        **{f"full disk {share:.3f}": partial(full_disk, share) for share in spread(FULL_DISKS)},
        **{f"kill {share:.3f}": partial(kill, share) for share in spread(KILLS, seed=0)},
    }


def waves() -> NDArray[np.float64]:
    """(32, 32) heights of crossing waves, mm, 0 to 1.5."""
    at = np.arange(32) / 32.0
    heights = np.sin(2 * np.pi * 3 * at)[:, None] + np.sin(2 * np.pi * (5 * at[None, :] + 2 * at[:, None]))
    lifted: NDArray[np.float64] = (heights - heights.min()) * (1.5 / np.ptp(heights))
    return lifted


def started(folder: Path, out: Path, *options: str, verb: str = "optimize") -> subprocess.Popen[str]:
    """The command in a process of its own."""
    places = [str(out)] if verb == "resume" else [str(folder / "run.toml"), "-o", str(out)]
    command = [sys.executable, "-m", "optimize", verb, *places, "-q", *options]
    return subprocess.Popen(command, cwd=ROOT, stderr=subprocess.PIPE, text=True)


def time_of_settings(process: subprocess.Popen[str], out: Path) -> float:
    """The time when a run has written its settings, or has ended."""
    while process.poll() is None and not (out / SETTINGS).is_file():
        time.sleep(0.005)
    return time.perf_counter()


def after_a_kill(folder: Path, seconds: float, heights: NDArray[np.float64]) -> dict[str, Any]:
    """A run killed so many seconds after its settings were written, and what ended it."""
    with tempfile.TemporaryDirectory(dir=folder) as place:
        out = Path(place) / "out"
        process = started(folder, out)
        time_of_settings(process, out)
        time.sleep(seconds)
        process.kill()
        process.communicate()
        return {"seconds": seconds, "status": process.returncode} | ended(folder, out, heights)


def after_a_full_disk(folder: Path, size: int, heights: NDArray[np.float64]) -> dict[str, Any]:
    """A run on a disk of so many bytes, and what ended it when the disk had grown."""
    with tempfile.TemporaryDirectory(dir=folder) as place, ExitStack() as stack:
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", place], check=True)
        stack.callback(subprocess.run, ["umount", place], check=True)
        out = Path(place) / "out"
        process = started(folder, out)
        _, messages = process.communicate(timeout=LONGEST_S)
        subprocess.run(["mount", "-o", "remount,size=1g", place], check=True)
        row = {"bytes": size, "status": process.returncode, "told": messages.replace(str(place), "").strip()}
        return row | ended(folder, out, heights)


def ended(folder: Path, out: Path, heights: NDArray[np.float64]) -> dict[str, Any]:
    """Which command ended an interrupted run, and the distance of its heights from those wanted, mm."""
    attempts: dict[str, Sequence[Any]] = {"resume": (), "optimize": (), "optimize --force": ("--force",)}
    for name, options in attempts.items():
        process = started(folder, out, *options, verb=name.split()[0])
        _, messages = process.communicate(timeout=LONGEST_S)
        if process.returncode in (0, 3):
            distance = float(np.abs(load_checkpoint(out).best.heights - heights).max())
            return {"ended_by": name, "distance_mm": distance, "same": distance <= SAME_MM}
        if process.returncode != 2 or len(messages.splitlines()) != 1:
            break
    return {"ended_by": None, "distance_mm": None, "same": False, "last": messages.strip()}


def summary(rows: dict[str, dict[str, Any]]) -> str:
    """The table: one row for kills, one for full disks."""
    lines = []
    for kind in ("kill", "full disk"):
        of_kind = [row for name, row in rows.items() if name.startswith(kind)]
        by = [row["ended_by"] for row in of_kind]
        counts = [by.count(name) for name in ("resume", "optimize", "optimize --force", None)]
        farthest = max((row["distance_mm"] for row in of_kind if row["ended_by"]), default=None)
        same = sum(row["same"] for row in of_kind)
        lines.append([kind, len(of_kind), *counts, same, farthest])
    head = ("cases", "number", "resume", "optimize", "--force", "stuck", "same heights", "farthest, mm")
    return table(head, lines)


if __name__ == "__main__":
    main()
