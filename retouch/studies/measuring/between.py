"""Feel of a result between the places that its descent has steered, by finite elements."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optimize.settings.run_file import Run
from optimize.verification.felt_places import jnd_at, sampled
from relief.common.arrays import Array, Index
from relief.heightmap import load_heights
from relief.places import SPACING_MM, between
from relief.relief import Relief
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from visual.scene import plate_size_mm


def felt_between(run_dir: Path, run: Run, result: Mapping[str, Any]) -> dict[str, float | None]:
    """Just-noticeable differences from the original to the result of a run, away from the steered places.

    The places lie in the middle between those of the usual spacing, whatever the spacing of the run, so that
    runs that are steered at one place compare with others.

    Args:
        run_dir: of the run.
        run: its settings.
        result: content of result.json, which holds the same presses if the run has the usual spacing.

    Returns:
        The columns of the measure; None on a plate that has one place, and for distances from the target
        where the run has none in JND.
    """
    relief = run.relief(plate_size_mm(run.scene, run.define))
    at = sampled(between(relief.surface, min(run.touch.spacing_mm, SPACING_MM)))
    if not len(at):
        return dict.fromkeys(NAMES)
    told = _told(run, result)
    if told is None:
        after = load_heights(run_dir / "heights.exr")
        told = (
            _pressed(relief.heights, run, relief.width_mm, at),
            _pressed(after, run, relief.width_mm, at),
        )
    before, after = told
    jnd = jnd_at(after, before)
    felt = jnd[np.isfinite(jnd)]
    if not felt.size:
        return dict.fromkeys(NAMES) | {"between_count": 0.0}
    target = run.touch.numbers().get("jnd")
    off = None if target is None else felt - target
    numbers = (
        len(felt),
        felt.mean(),
        felt.min(),
        felt.max(),
        None if off is None else off.mean(),
        None if off is None else np.abs(off).max(),
    )
    return {
        name: None if number is None else float(number) for name, number in zip(NAMES, numbers, strict=True)
    }


def _told(run: Run, result: Mapping[str, Any]) -> tuple[Array, Array] | None:
    """Roughness of original and result between the places, as the run has pressed them by finite elements."""
    touch = result.get("touch", {})
    if run.touch.spacing_mm > SPACING_MM or touch.get("verified_by") != "fem":
        return None
    pressed = touch["places"].get("between")
    if pressed is None:
        return None
    before, after = (np.array(pressed[f"{when}_{ROUGHNESS.name}"]) for when in ("initial", "verified"))
    return before, after


def _pressed(heights: Array, run: Run, size_mm: float, at: Index) -> Array:
    """(k,) roughness at places (k, 2), by finite elements."""
    mesh, repeats = run.verify.resolution, run.axes_repeat
    finger = run.touch.finger
    touch = measure_touch(Relief(heights, size_mm, repeats), finger, "fem", mesh, (ROUGHNESS,), at=at)
    return touch.values[ROUGHNESS.name]


NAMES = (
    "between_count",
    "between_mean_jnd",
    "between_least_jnd",
    "between_most_jnd",
    "between_off_jnd",
    "between_worst_jnd",
)
"""Columns of the measure."""
