"""Time and memory of whole runs by the size of the plate: 10, 25, 40 and 80 mm, 128 samples over 10 mm.

python -m benchmarks.runs.large                # all; about an hour of a processor
python -m benchmarks.runs.large 10 25x500      # these; the others keep their numbers

25x500 is a plate of 25 mm with a sample each 50 um, as resin printers have pixels.

Gravel two JND rougher all over, by the fast look, verified by finite elements at every steered place. Every
run is a process of its own, as a user starts it; the 80 mm are solved window by window. The table goes into
docs/evidence/speed.md.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.runs.whole_run import PARTS
from benchmarks.shared.checkouts import process
from benchmarks.shared.common import DOCS, ROOT, load, machine, parser_of, put, save, table
from mitsuba_scenes import find_texture
from optimize.run_directory.key import read_verification
from relief.preparing.preparation import prepare

PAGE = DOCS / "evidence" / "speed.md"
PLATES = {"10": (10, 128), "25": (25, 320), "25x500": (25, 500), "40": (40, 512), "80": (80, 1024)}
"""Side in mm and samples along it, by the name on the command line."""
SETTINGS = (
    *("touch.jnd=2", "look.model=fast", "verify.baseline=false", "verify.samples=64"),
    # Gravel takes 4 to 7 steps at every size; the limit bounds the time of a run that goes wrong.
    "descent.steps=12",
)
SHOWN = {
    **{"size_mm": "plate, mm", "samples": "samples", "places": "places", "cpu_s": "CPU seconds"},
    **{"minutes": "minutes", "peak_gb": "peak GB", "steps": "steps", "step_cpu_s": "a step, CPU s"},
    **{"least_jnd": "least JND", "largest_jnd": "largest", "change_rms_percent": "pictures rms, %"},
}
"""Columns of the page by key."""
SEVERAL_PLACES_MM = 25
"""Least side of which the exponents are taken: a plate of 10 mm is touched once."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("plates", nargs="*", choices=PLATES, help="sides, mm; default: all")
    results = load("large") or {"rows": []}
    for name in parser.parse_args().plates or PLATES:
        row = measured(*PLATES[name])
        rows = [each for each in results["rows"] if side(each) != side(row)]
        results = {"machine": machine(), "rows": sorted([*rows, row], key=side)}
        results["exponents"] = exponents(results["rows"])
        save("large", results)
        print(row, flush=True)
    text = as_text(results)
    print(text)
    put(PAGE, "sizes", "benchmarks.runs.large", text)


def side(row: Mapping[str, Any]) -> tuple[int, int]:
    """Side of the plate of a row, mm, and its samples."""
    return row["size_mm"], row["samples"]


def as_text(results: Mapping[str, Any]) -> str:
    """The table, and a line of the exponents."""
    shown = [{**row, "cpu_s": round(row["cpu_s"])} for row in results["rows"]]
    text = table([*SHOWN.values()], [[row[key] for key in SHOWN] for row in shown])
    powers = [f"{SHOWN[key]} {power:.2f}" for key, power in results["exponents"].items()]
    grown = f"\nExponents in the area, from {SEVERAL_PLACES_MM} mm: {', '.join(powers)}.\n" if powers else ""
    return f"{text}\n{grown}"


def measured(size_mm: int, samples: int) -> dict[str, Any]:
    """Size, seconds, memory and feel of one run."""
    with tempfile.TemporaryDirectory() as folder:
        texture, out = Path(folder) / "gravel.png", Path(folder) / "run"
        prepare(find_texture("gravel-tile"), plate_mm=size_mm).save(texture)
        prepare(texture, samples=samples).save(texture)
        settings = [part for setting in SETTINGS for part in ("--set", setting)]
        command = ["optimize", "gravel", "--texture", str(texture), *settings, "-o", str(out), "-q"]
        found = process(ROOT, ["-m", "optimize", *command], (0, 3))
        result = read_verification(out)
    assert result is not None
    places, steps = result.touch.places, result.stop.steps
    assert places is not None
    return {
        "size_mm": size_mm,
        "samples": samples,
        "places": places.steered.count,
        "minutes": found["wall_s"] / 60.0,
        "cpu_s": found["cpu_s"],
        "peak_gb": found["peak_mb"] / 1e3,
        **{f"{part}_cpu_s": result.cpu_s[part] for part in PARTS},
        "reason": result.stop.reason,
        "steps": steps,
        "step_cpu_s": result.cpu_s["descent"] / max(steps, 1),
        "jnd": result.touch.jnd_from_original,
        "least_jnd": places.jnd_min,
        "largest_jnd": places.jnd_max,
        "change_percent": result.look.change_percent,
        "change_rms_percent": result.look.change_rms_percent,
    }


def exponents(rows: list[dict[str, Any]]) -> dict[str, float]:
    """Powers of the area that seconds and memory grow with at one pitch of the samples, by least squares."""
    coarse = [row for row in rows if side(row) != PLATES["25x500"]]
    large = [row for row in coarse if row["size_mm"] >= SEVERAL_PLACES_MM]
    if len(large) < 2:
        return {}
    area = np.log([row["size_mm"] ** 2 for row in large])
    return {
        key: float(np.polyfit(area, np.log([row[key] for row in large]), 1)[0])
        for key in ("cpu_s", "step_cpu_s", "peak_gb")
    }


if __name__ == "__main__":
    main()
