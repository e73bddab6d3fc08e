"""Places that stay without texture because the surface cannot carry it there."""

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, smooth_step
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.refining import refined

SPACING_MM = 0.5
"""Distance of points on triangles that stay without texture, mm, but on areas too large to be left out."""
MOST_POINTS = 100_000
"""Points on such triangles, about."""


class PlaceError(InputError):
    """A place at which a surface cannot carry texture.

    Attributes:
        fault: Why, and where.
        points: (n, 3) points of the place, mm.
    """

    def __init__(self, field: str, fault: str, advice: str, points: Array) -> None:
        super().__init__(
            f"{field}: {fault}; {advice.format('unite')}", f"{field}: {fault}; {advice.format('--unite')}"
        )
        self.fault, self.points = fault, points


def points_on(body: Body, faces: Index) -> Array:
    """(n, 3) points all over faces, (k,) numbers, mm."""
    alone = Body(body.vertices, body.faces[faces])
    spacing = max(SPACING_MM, float(np.sqrt(2.0 * alone.areas.sum() / MOST_POINTS)))
    fine = refined(alone, spacing).body
    return np.asarray(fine.vertices[np.unique(fine.faces)])


class Bare:
    """Points without texture.

    Attributes:
        reach_mm: Distance from them within which there is none, mm.
    """

    def __init__(self, points: Array, reach_mm: float = 0.0) -> None:
        self._tree, self.reach_mm = cKDTree(points), reach_mm

    def share(self, places: Array, falloff_mm: float) -> Array:
        """Share (n,) of the texture at places (n, 3): 0 within the reach, 1 from the falloff beyond it."""
        farthest = self.reach_mm + falloff_mm
        away, _ = self._tree.query(places, distance_upper_bound=farthest)
        return smooth_step(np.maximum(np.minimum(away, farthest) - self.reach_mm, 0.0) / falloff_mm)
