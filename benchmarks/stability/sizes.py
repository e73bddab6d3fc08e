"""The smallest and the largest plates and tiles, through whole commands.

python -m benchmarks.stability.sizes            # every command that is not in the results yet
python -m benchmarks.stability.sizes --again    # every command

Each size is evaluated and made smoother in two steps; the result is compared, measured as a print, exported
and resumed. Every command has to end with status 0 or 3, or with one line, status 2 and nothing written.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.shared.common import ROOT, again_given, kept, load, table
from relief.heightmap import save_heights_exr

NAME = "sizes"
PLATES_MM, TILES_MM = (0.1, 1.0, 3.0, 100.0, 1000.0), (0.1, 1.0, 100.0)
"""Widths: the least and the greatest that are exported, those under a finger, and the widest pairs."""
SAMPLES = {0.1: 16, 1.0: 32, 3.0: 32, 100.0: 160, 1000.0: 160}
"""Samples a side by width: 16 or more of the 10 mm under a finger on 100 mm, too few on 1000 mm."""
SPACING_MM = 30.0
"""Distance of the places of the finger, so that 100 mm have few."""
SETTINGS = {"descent.steps": 2, "verify.model": "layer", "verify.samples": 4, "touch.spacing_mm": SPACING_MM}
LONGEST_S = 600.0
"""Seconds after which a command counts as hanging."""
RUN = "run"
COMMANDS = {
    "evaluate": ("evaluate", "waves.exr", "{size}"),
    "export": ("export", "waves.exr", "{size}", "-o", "design.3mf"),
    "optimize": (
        "optimize",
        "waves.exr",
        "{size}",
        "--jnd=-1",
        "-o",
        RUN,
        "-q",
        "--no-baseline",
        "{settings}",
    ),
    "compare": ("compare", RUN, "-o", "comparison.html"),
    "evaluate the print": ("evaluate", f"{RUN}/plate.stl", "-o", "coloured"),
    "export the run": ("export", RUN, "-o", "plate.glb"),
    "resume": ("resume", RUN, "-q"),
}
"""Commands by what they do; those after `optimize` need its run."""


def main() -> None:
    again = again_given(__doc__)
    sizes = [*(("plate", mm) for mm in PLATES_MM), *(("tile", mm) for mm in TILES_MM)]
    for kind, mm in sizes:
        kept(NAME, "rows", f"{kind} of {mm:g} mm", partial(outcomes, mm, kind == "tile"), again)
    print(summary(load(NAME)["rows"]))


def waves(samples: int) -> NDArray[np.float64]:
    """(samples, samples) heights of crossing waves, mm, 0 to 0.1."""
    at = 2.0 * np.pi * np.arange(samples) / samples
    heights: NDArray[np.float64] = 0.05 + 0.025 * (
        np.sin(3 * at)[:, None] + np.sin(4 * at[None, :] + at[:, None])
    )
    return heights


def outcomes(mm: float, repeats: bool) -> dict[str, Any]:
    """Outcome of the commands: status, CPU seconds, and the line of a refusal."""
    results: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as temporary:
        place = Path(temporary)
        save_heights_exr(place / "waves.exr", waves(SAMPLES[mm]))
        parts = {
            "{size}": [f"--size-mm={mm}", *(["--repeats"] if repeats else [])],
            "{settings}": [f"--set={key}={value}" for key, value in SETTINGS.items()],
        }
        for name, words in COMMANDS.items():
            arguments = [part for word in words for part in parts.get(word, [word])]
            if name == "export":
                arguments = [part for part in arguments if part != "--repeats"]
            if RUN in arguments[1] and not (place / RUN).is_dir():
                continue
            before = sorted(place.rglob("*"))
            results[name] = row = ended(arguments, place)
            refused = row["status"] == 2 and len(row["told"]) == 1 and sorted(place.rglob("*")) == before
            row["as_promised"] = refused or row["status"] in (0, 3)
    return results


def ended(arguments: list[str], place: Path) -> dict[str, Any]:
    """Status and CPU seconds of a command, and the lines that say why it has ended."""
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "retouch", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.run(
        command, cwd=place, env=environment, capture_output=True, text=True, timeout=LONGEST_S, check=False
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    messages = [line for line in process.stderr.splitlines() if line.startswith(("retouch:", "Traceback"))]
    seconds = after.ru_utime + after.ru_stime - spent.ru_utime - spent.ru_stime
    return {"status": process.returncode, "cpu_s": round(seconds, 1), "told": messages}


def summary(rows: dict[str, Any]) -> str:
    """The table: the status of each command at each size, "!" behind those that are not as promised."""
    lines = [
        [size, *(f"{row['status']}{'' if row['as_promised'] else '!'}" if row else "-" for row in cells)]
        for size, results in rows.items()
        for cells in [[results.get(name) for name in COMMANDS]]
    ]
    return table(("status", *COMMANDS), lines)


if __name__ == "__main__":
    main()
