"""Feel of a result between the places that its descent has steered, by finite elements."""

import numpy as np

from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.run_file import Run
from optimize.verification.felt_places import sampled
from optimize.verification.verification import Verification
from relief.ground.arrays import Array, Index
from relief.places import SPACING_MM, between
from relief.relief import Relief
from tactile.jnd import jnds_apart
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS


def felt_between(run: FinishedRun) -> dict[str, float | None]:
    """Just-noticeable differences from the original to the result of a run, away from the steered places.

    The places lie in the middle between those of the usual spacing, whatever the spacing of the run, so that
    runs that are steered at one place compare with others. What the run has pressed there is not pressed
    again.

    Returns:
        The columns of the measure; None on a plate that has one place, and for distances from the target
        where the run has none in JND.
    """
    at = sampled(between(run.original.surface, min(run.settings.touch.spacing_mm, SPACING_MM)))
    if not len(at):
        return dict.fromkeys(NAMES)
    pressed = _as_verified(run.settings, run.verification)
    if pressed is None:
        pressed = _pressed(run.original, run.settings, at), _pressed(run.result, run.settings, at)
    before, after = pressed
    jnd = jnds_apart(after, before)
    felt = jnd[np.isfinite(jnd)]
    if not felt.size:
        return dict.fromkeys(NAMES) | {"between_count": 0.0}
    target = run.settings.touch.numbers().get("jnd")
    off = None if target is None else felt - target
    numbers = [len(felt), felt.mean(), felt.min(), felt.max()]
    numbers += [] if off is None else [off.mean(), np.abs(off).max()]
    return dict.fromkeys(NAMES) | dict(zip(NAMES, map(float, numbers), strict=False))


def _as_verified(run: Run, result: Verification) -> tuple[Array, Array] | None:
    """Roughness of original and result between the places, as the run has pressed them by finite elements."""
    places = result.touch.places
    if run.touch.spacing_mm > SPACING_MM or result.touch.verified_by != "fem":
        return None
    if places is None or places.between is None:
        return None
    initial, verified = places.between.initial, places.between.verified
    return np.array(initial[ROUGHNESS.name]), np.array(verified[ROUGHNESS.name])


def _pressed(relief: Relief, run: Run, at: Index) -> Array:
    """(k,) roughness at places (k, 2), by finite elements."""
    touch = measure_touch(relief, run.touch.finger, "fem", run.verify.resolution, (ROUGHNESS,), at=at)
    return touch.values[ROUGHNESS.name]


NAMES = ("between_count", *(f"between_{name}_jnd" for name in ("mean", "least", "most", "off", "worst")))
"""Columns of the measure."""
