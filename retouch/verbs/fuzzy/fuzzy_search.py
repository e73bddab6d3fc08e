"""The fuzzy skin of a roughness: thickness and point distance, found by pressing on computed walls."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import brentq

from optimize.verification.solids.mesh_feel import pressed
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.progress import stage
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.fuzzy_skin import fuzzy_wall
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin

PATCHES = 16
"""Places on a computed wall. V differs by 5 % from place to place, so that its mean is known to 1.3 %,
0.07 just-noticeable differences."""
FINEST_MM = 1e-3
"""Step of thickness and point distance, mm: G-code has three decimals, and slicers' windows four."""
SPARSEST_MM = 1.2
"""Point distance, mm, beyond which V does not grow: from 1.2 to 5 mm V changes by less than the 5 % among
places, for thicknesses of 0.1 and 0.3 mm."""


@dataclass(frozen=True)
class Wall:
    """An outer wall, and the finger that presses on it.

    Attributes:
        width_mm: of the bead.
        layer_mm: height of a layer.
        skin: of the finger.
    """

    width_mm: float
    layer_mm: float
    skin: Skin


@cache
def roughness(wall: Wall, thickness_mm: float, point_distance_mm: float) -> float:
    """Mean roughness of a wall with a fuzzy skin, no unit; its points are drawn alike for every thickness."""
    side_mm, random = wall.skin.patch_mm or PATCH_SIDE_MM, np.random.default_rng(0)
    of_wall = wall.width_mm, wall.layer_mm, side_mm, PATCHES, random
    beads, places = fuzzy_wall(thickness_mm, point_distance_mm, *of_wall)
    surface = BeadSurface(beads, side_mm=wall.skin.patch_mm)
    heights = np.stack([surface.crop(place).heights for place in places])
    return float(pressed(heights, wall.skin, "layer", side_mm)[0][ROUGHNESS.name].mean())


def nearest(wall: Wall, target: float, point_distance_mm: float, most_mm: float) -> tuple[float, float]:
    """Thickness and point distance, mm, of the fuzzy skin whose roughness is nearest to a target.

    Args:
        wall: that becomes fuzzy.
        target: roughness that is wanted.
        point_distance_mm: kept, unless no thickness is rough enough with it.
        most_mm: largest thickness.
    """
    points, most = point_distance_mm, round(most_mm, 3)
    with stage("finding the fuzzy skin"):
        if roughness(wall, most, points) < target:
            sparse = max(points, SPARSEST_MM)
            if roughness(wall, most, sparse) <= target:
                return most, sparse
            points = _root(lambda each: roughness(wall, most, each) - target, points, sparse)
            points += FINEST_MM * (roughness(wall, most, points) < target)
        if roughness(wall, FINEST_MM, points) >= target:
            return FINEST_MM, points
        return _root(lambda each: roughness(wall, each, points) - target, FINEST_MM, most), points


def _root(excess: Callable[[float], float], low: float, high: float) -> float:
    """Where a function that is negative at `low` and positive at `high` is 0, in whole steps, mm."""
    return round(float(brentq(excess, low, high, xtol=0.5 * FINEST_MM)), 3)
