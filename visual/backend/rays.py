"""Rays against the plate by Mitsuba, from and to numpy arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from visual.backend.mitsuba import mi
from visual.backend.plate_shape import plate_shape

MISSED_MM = 1e4
"""Distance, mm, given to rays that meet no plate: finite, so that points along them are too."""
REACH = 20.0
"""Longest shadow rays, sides of the plate: half the least distance of area lights that have gradients
(`visual.lights.area_lights`). What is farther does not stand in the light, it is the light."""
SHORT_OF_LAMP = 1e-3
"""Part of a shadow ray to a near lamp that is left out: the lamp's own surface is no obstacle. Mitsuba leaves
out 0.9e-3."""


def blocked(
    scene: Any, origins: Array, directions: Array, distance: Array | float = np.inf
) -> NDArray[np.bool_]:
    """Whether a shape of the scene lies within `REACH` along each ray.

    Args:
        scene: Mitsuba scene with a plate.
        origins: (rays, 3) mm.
        directions: (rays, 3) unit vectors, or one (3,) of all rays.
        distance: (rays,) mm, to where each ray ends at the latest.

    Returns:
        (rays,).
    """
    if len(origins) == 0:
        return np.zeros(0, dtype=bool)
    rays = _rays(origins, directions)
    plate = plate_shape(scene)
    reach = REACH * plate.size_mm * max(1.0, plate.rows / plate.cols)
    ends = np.minimum(np.asarray(distance) * (1.0 - SHORT_OF_LAMP), reach)
    rays.maxt = mi.Float(ends.astype(np.float32)) if ends.ndim else float(ends)
    return np.asarray(scene.ray_test(rays)).astype(bool)


def first_hits(scene: Any, origins: Array, directions: Array) -> tuple[NDArray[np.int64], Array]:
    """Faces of the plate that rays meet first.

    Args:
        scene: Mitsuba scene with a plate; it may hold further shapes, whose faces are numbered from 0 too.
        origins: (rays, 3) mm.
        directions: (rays, 3) unit vectors.

    Returns:
        Face (rays,), -1 where a ray meets nothing or another shape, and distance (rays,), mm.
    """
    if len(origins) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    hit = scene.ray_intersect_preliminary(_rays(origins, directions))
    on_plate = hit.is_valid() & (hit.shape == mi.ShapePtr(plate_shape(scene)))
    valid = np.asarray(on_plate).astype(bool)
    face = np.asarray(hit.prim_index).astype(np.int64)
    return np.where(valid, face, -1), np.where(valid, np.asarray(hit.t, dtype=np.float64), MISSED_MM)


def _rays(origins: Array, directions: Array) -> Any:
    return mi.Ray3f(mi.Point3f(vectors(origins)), vectors(directions))


def vectors(values: Array) -> Any:
    """Vectors (n, 3), or one (3,), as `mi.Vector3f`."""
    return mi.Vector3f(*(mi.Float(np.ascontiguousarray(values[..., a], dtype=np.float32)) for a in range(3)))
