"""Depth of a relief: no finger reaches places more than 3 mm below its top, which are visible (paper 7.1)."""

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM

CLEARANCE_MM = 0.1
"""Least distance, mm, of the skin from the level at which a relief is cut off for touch: 25 times the
difference of models of touch in the depth that the skin reaches (docs/evidence/touch.md)."""


def floor_mm(heights: Array) -> float:
    """The level, mm, 3 mm below the top of a relief (rows, cols); 0 if the relief is no higher than 3 mm."""
    return max(0.0, float(heights.max()) - HEIGHT_LIMIT_MM)


def within_reach(heights: Array) -> Array:
    """The part of a relief (rows, cols) that a finger can reach: heights above `floor_mm`, 0 to 3 mm."""
    floor = floor_mm(heights)
    return heights if floor == 0.0 else np.maximum(heights - floor, 0.0)


def out_of_reach(heights: Array) -> NDArray[np.bool_] | None:
    """Samples (rows, cols) lower than `floor_mm`, which a descent leaves as they are; None if none are."""
    low = heights < floor_mm(heights)
    return low if low.any() else None


def check_reach(fields: Array, gap: Array) -> None:
    """Check that the skin stays clear of the level at which reliefs were cut off.

    Args:
        fields: (k, n, n) mm, patches of `within_reach`.
        gap: (k, n, n) mm, distance of the skin from them.

    Raises:
        InputError: over samples lower than `CLEARANCE_MM` the skin comes lower than that.
    """
    # Where there is nothing below a round finger, heights are minus infinity.
    low = (fields < CLEARANCE_MM) & np.isfinite(fields)
    lowest = float((fields + gap)[low].min()) if low.any() else HEIGHT_LIMIT_MM
    if lowest < CLEARANCE_MM:
        reached = f"a finger reaches {HEIGHT_LIMIT_MM - lowest:.2f} mm below the top"
        most = f"the most is {HEIGHT_LIMIT_MM - CLEARANCE_MM:g} where a relief exceeds {HEIGHT_LIMIT_MM:g} mm"
        raise InputError(
            f"heights: {reached}; {most}: make the relief lower (relief_mm), or its ridges wider or closer"
        )
