"""Whole runs: seconds, CPU seconds and peak memory, each a process of its own, as a user starts it.

python -m benchmarks.whole_run [CASE ...] [--again]    # cases that results/whole_run.json lacks, or all

Cases: the six demo runs, exact and fast, the tile demo, gravel of 256 x 256 samples, and plates of 25, 40 and
80 mm (two just-noticeable differences rougher all over, by the fast look). A short run of the same case comes
first, which builds operators and kernels. Run the cases on a quiet machine; all take about 20 minutes.
"""

from __future__ import annotations

import json
import statistics
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from skimage.transform import resize

from benchmarks.shared.common import publish, rows_of, table
from benchmarks.shared.processes import process
from mitsuba_scenes import find_texture
from optimize.settings.run_file import load_run
from relief.heightmap import load_heights, save_heights_exr
from relief.preparing.picture_preparation import prepare

RESULT = "whole_run"
DEMO_RUNS = [(texture, jnd) for texture in ("gravel", "brick", "grass") for jnd in (-2, 2)]
"""Bundled run and target, JND, of the demo runs."""
MODELS: Mapping[str, Sequence[str]] = {"exact": (), "fast": ("--fast",)}
"""Options of `optimize` by the models that steer."""
PLATES = ((25, 320), (25, 500), (40, 512), (80, 1024))
"""Sides of the plates, mm, and samples along them; 500 are one each 50 µm, as resin printers have pixels."""
ON_PLATES = (
    *("touch.jnd=2", "repeats=false", "look.model=fast", "verify.baseline=false", "verify.samples=64"),
    # Gravel takes 2 to 4 steps at every size; the limit bounds the time of a run that goes wrong.
    "descent.steps=12",
)
SHORT = ("descent.steps=1", "verify.corrections=0")
"""Settings of the run that warms up."""
DONE = (0, 3)
"""Exit statuses of a run that has a result: the target is met, or is not."""


@dataclass(frozen=True)
class Case:
    """A run: the line of the table that it is counted in, options of `optimize`, width in mm, and samples."""

    group: str
    options: Sequence[str]
    size_mm: int = 10
    samples: int = 128


def _cases() -> Iterator[tuple[str, Case]]:
    for models, options in MODELS.items():
        for texture, jnd in DEMO_RUNS:
            name = f"{texture}{jnd:+d}{'-fast' * bool(options)}"
            yield name, Case(f"demo runs, {models}", (texture, *_set(f"touch.jnd={jnd}"), *options))
    yield "tile", Case("tile, 10 mm", ("mitsuba_scenes/gravel-tile.toml",))
    yield "256x256", Case("10 mm, 256², exact", ("gravel", "-D", "resolution=256"), 10, 256)
    for size_mm, samples in PLATES:
        words = f"{size_mm} mm, {samples}²"
        yield f"{size_mm}mm-{samples}", Case(words, ("gravel", *_set(*ON_PLATES)), size_mm, samples)


def _set(*settings: str) -> Sequence[str]:
    return [part for setting in settings for part in ("--set", setting)]


CASES: Mapping[str, Case] = dict(_cases())


def texture_of(case: Case, folder: Path) -> Sequence[str]:
    """Options that name the texture of a case, which is written into a folder if none of Retouch serves."""
    if case.size_mm == 10:
        return () if case.samples == 128 else ("--texture", str(finer(folder, case.samples)))
    path = folder / f"gravel-{case.size_mm}x{case.samples}.png"
    prepare(find_texture("gravel-tile"), plate_mm=case.size_mm).save(path)
    prepare(path, samples=case.samples).save(path)
    return "--texture", str(path)


def finer(folder: Path, samples: int) -> Path:
    """Write gravel, 10 mm wide, at more samples than come with Retouch."""
    run = load_run("gravel")
    coarse = load_heights(run.texture, relief_mm=run.relief_mm)
    fine = np.clip(resize(coarse, (samples, samples), order=3, mode="edge"), 0.0, 3.0)
    path = folder / f"gravel-{samples}.exr"
    save_heights_exr(path, fine, 10.0, float(fine.max()))
    return path


def run(case: Case) -> dict[str, Any]:
    """Seconds, memory and results of a run."""
    with tempfile.TemporaryDirectory() as name:
        out = Path(name) / "run"
        options = [*case.options, *texture_of(case, Path(name)), "-o", str(out), "--force", "-q"]
        process(["-m", "retouch", "optimize", *options, *_set(*SHORT)], DONE)
        spent = process(["-m", "retouch", "optimize", *options], DONE)
        result = json.loads((out / "result.json").read_text())
    return {
        "wall_s": spent.wall_s,
        "cpu_s": spent.cpu_s,
        "peak_mb": 1000.0 * spent.peak_gb,
        "places": ((result["touch"]["places"] or {}).get("steered") or {"count": 1})["count"],
        "off_target_percent": result["verification"]["miss_percent"],
        "change_percent": result["look"]["change_percent"],
    }


def as_table(runs: Mapping[str, Mapping[str, Any]]) -> str:
    """Cases by group: medians of seconds and memory, largest distance from the target."""
    rows = []
    for group in dict.fromkeys(case.group for case in CASES.values()):
        some = [row for name, row in runs.items() if CASES[name].group == group]
        middle = {key: statistics.median(row[key] for row in some) for key in ("wall_s", "cpu_s", "peak_mb")}
        cells = f"{middle['wall_s']:.0f}", f"{middle['cpu_s']:.0f}", f"{middle['peak_mb'] / 1000.0:.1f}"
        off = max(row["off_target_percent"] for row in some)
        rows.append((group, some[0]["places"], *cells, f"{off:.1f}"))
    return table(("run", "contact locations", "s", "CPU s", "GB", "off target, % at most"), rows)


def main() -> None:
    measures = {name: partial(run, case) for name, case in CASES.items()}
    rows = rows_of(__doc__, RESULT, "runs", measures)
    publish("speed", "seconds", as_table(rows))


if __name__ == "__main__":
    main()
