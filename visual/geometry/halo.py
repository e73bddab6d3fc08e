"""Halo of a tile: how many samples of its neighbours throw shadows on it and hide light from it."""

import math
from collections.abc import Sequence

from relief.ground.arrays import Array
from relief.plate_grid import Halo
from relief.surface import Surface

MARGIN = 1.25
"""Factor of the range of the heights: a relief grows while it changes, the halo stays."""
LEAST_TANGENT = 0.5
"""Least tangent of an elevation, that of 27 degrees, from which light of many directions is followed into the
neighbours; docs/evidence/appearance.md has the pictures' error by the width of the halo."""
FEWEST = 2
"""Least samples of the halo: cells on both sides of the seam are whole."""


def rise_of(heights: Array) -> float:
    """Rise, mm, expected between the lowest and highest points of a relief (rows, cols) during a run."""
    return MARGIN * float(heights.max() - heights.min())


def halo_of(surface: Surface, rise_mm: float, toward: Sequence[tuple[float, float, float] | None]) -> Halo:
    """Samples of the neighbours from which something reaches the plate, one period at most.

    Args:
        surface: of the relief.
        rise_mm: from the lowest to the highest point, of `rise_of`.
        toward: unit vectors toward the lights; None for light of many directions.

    Returns:
        Samples beyond each side along y and x, 0 where the surface ends.
    """

    def reach(axis: int) -> float:
        """Distance along an axis, mm, from which the highest sample reaches the lowest."""
        longest = 0.0
        for light in toward:
            along, tangent = 1.0, LEAST_TANGENT
            if light is not None:
                level = math.hypot(light[0], light[1])
                if level == 0.0:
                    continue
                along, tangent = abs(light[1 - axis]) / level, max(light[2] / level, 0.0)
            longest = max(longest, rise_mm * along / tangent if tangent > 0.0 else math.inf)
        return longest

    def samples(axis: int) -> int:
        if not surface.repeats[axis]:
            return 0
        wanted = reach(axis) / surface.pitch_mm
        most = surface.shape[axis]
        return most if wanted >= most else max(FEWEST, math.ceil(wanted) + 1)

    return samples(0), samples(1)
