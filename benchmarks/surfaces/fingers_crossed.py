"""Tiles steered for one finger, felt by others: the default, the measured one, soft, stiff, other forces.

retouch study benchmarks/surfaces/fingers_crossed.toml -o runs/crossed
python -m benchmarks.surfaces.fingers_crossed runs/crossed   # presses the results; JSON and the page's tables
"""

from __future__ import annotations

import statistics
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import load, machine, publish, save, study_given, table
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.skins import load_skin
from relief.ground.arrays import Array
from relief.ground.progress import say
from relief.places import places
from relief.relief import Relief
from tactile.jnd import jnd_apart
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS

STEERED = ("paper", "measured")
FELT: Mapping[str, tuple[str, float]] = {
    "paper, 10 N": ("paper", 10.0),
    **{f"measured, {force:g} N": ("measured", force) for force in (0.6, 1.0, 2.0)},
    "measured-soft, 1 N": ("measured-soft", 1.0),
    "measured-stiff, 1 N": ("measured-stiff", 1.0),
}
"""Skin and force of every finger that presses, by finite elements."""
WITHIN_JND = 0.25
"""Distance from the target up to which a location meets it."""
PLACES = 4
"""Places of a tile on which each of these fingers presses; the steered one is verified at 16 and between."""


def main() -> None:
    study = study_given(__doc__)
    if study is not None:
        rows = {}
        for row in rows_in(study):
            name = f"{row['texture']} {row['touch.jnd']:+g}, {row['touch.skin']}"
            say(name)
            rows[name] = measured(study, row)
        save("fingers_crossed", {"rows": rows, "machine": machine()})
    rows = load("fingers_crossed")["rows"]
    publish("touch", "optimised", optimised(rows))
    publish("touch", "crossed", crossed(rows))


def measured(study: Path, row: Row) -> dict[str, Any]:
    """Result of a run of the study, and how its change feels to every finger, JND at each place."""
    run = FinishedRun.read(folder_of(study, row))
    all_over = run.verification.touch.places
    assert all_over is not None
    before, after = run.original.heights, run.result.heights
    return {
        "jnd": row["touch.jnd"],
        "skin": row["touch.skin"],
        "farthest_jnd": all_over.farthest_from_target_jnd,
        "rms_percent": row["change_rms_percent"],
        "cpu_s": row["cpu_s"],
        "felt": {name: felt(before, after, *finger).tolist() for name, finger in FELT.items()},
    }


def felt(before: Array, after: Array, name: str, force_n: float) -> Array:
    """(places,) JND of a tile's change to a finger."""
    skin = replace(load_skin(name), force_n=force_n)
    reliefs = [Relief(heights, 10.0, (True, True)) for heights in (before, after)]
    every = places(reliefs[0].surface)
    at = every[:: len(every) // PLACES]
    pressed = (measure_touch(relief, skin, "fem", quantities=(ROUGHNESS,), at=at) for relief in reliefs)
    pairs = zip(*(touch.values[ROUGHNESS.name] for touch in pressed), strict=True)
    return np.array([jnd_apart(float(then), float(first)) for first, then in pairs])


def optimised(rows: Mapping[str, Any]) -> str:
    """Distance of the farthest location from the target, pictures and seconds, by finger."""
    lines = []
    for skin in STEERED:
        own = [row for row in rows.values() if row["skin"] == skin]
        far = sorted(row["farthest_jnd"] for row in own)
        within = sum(off <= WITHIN_JND for off in far)
        rms, seconds = (statistics.median(row[key] for row in own) for key in ("rms_percent", "cpu_s"))
        cells = (f"{statistics.median(far):.2f}", f"{within} of {len(own)}", f"{rms:.1f}", f"{seconds:.0f}")
        lines.append((f"`{skin}`", *cells))
    heads = ("farthest location off, JND", f"all within {WITHIN_JND} JND", "pictures rms, %", "CPU s")
    return table(("optimised for, medians", *heads), lines)


def crossed(rows: Mapping[str, Any]) -> str:
    """Mean and range over the tiles of what each finger feels of them, by the finger they are steered for."""
    lines = []
    for name in FELT:
        cells = []
        for skin in STEERED:
            for jnd in (-2, 2):
                own = [row for row in rows.values() if row["skin"] == skin and row["jnd"] == jnd]
                means = [statistics.fmean(row["felt"][name]) for row in own]
                cells.append(f"{statistics.fmean(means):+.2f} ({min(means):+.2f} to {max(means):+.2f})")
        lines.append((name, *cells))
    head = (f"optimised for {skin}, {jnd:+d}" for skin in STEERED for jnd in (-2, 2))
    return table(("felt by", *head), lines)


if __name__ == "__main__":
    main()
