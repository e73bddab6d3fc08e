"""Rays against the plate by Mitsuba, from and to numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FAR_MM = 1e4
REACH = 20.0
"""Half the least distance of area lights that have gradients; see `visual.lights.area`."""


def plate_shape(scene: Any) -> Any:
    """The height field in a Mitsuba scene."""
    return next(shape for shape in scene.shapes() if type(shape).__name__ == "HeightField")


def _rays(origins: Array, directions: Array) -> Any:
    import mitsuba as mi

    o, d = (
        mi.Vector3f(*(mi.Float(np.ascontiguousarray(v[:, a], dtype=np.float32)) for a in range(3)))
        for v in (origins, directions)
    )
    return mi.Ray3f(mi.Point3f(o), d)


def blocked(scene: Any, origins: Array, directions: Array) -> NDArray[np.bool_]:
    """Whether something lies along each ray. `origins`, `directions`: (rays, 3). No ray: no work.

    Rays end after `REACH` sides of the plate: what is farther does not stand in the light, it is the light.
    """
    if len(origins) == 0:
        return np.zeros(0, dtype=bool)
    rays = _rays(origins, directions)
    box = plate_shape(scene).bbox()
    rays.maxt = REACH * float(max(box.max - box.min))
    return np.asarray(scene.ray_test(rays)).astype(bool)


def first_hits(scene: Any, origins: Array, directions: Array) -> tuple[NDArray[np.int64], Array]:
    """Face of the plate that each ray meets first (-1: nothing or another shape) and distance in mm, (rays,).

    The scene may hold further shapes, whose faces are numbered from 0 too.
    """
    import mitsuba as mi

    if len(origins) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    hit = scene.ray_intersect_preliminary(_rays(origins, directions))
    on_plate = hit.is_valid() & (hit.shape == mi.ShapePtr(plate_shape(scene)))
    valid = np.asarray(on_plate).astype(bool)
    face = np.asarray(hit.prim_index).astype(np.int64)
    return np.where(valid, face, -1), np.where(valid, np.asarray(hit.t, dtype=np.float64), FAR_MM)
