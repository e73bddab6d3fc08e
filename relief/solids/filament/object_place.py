"""Where a CAD object lies among the beads that a slicer made of it, and the regions of a sliced part."""

from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.mesh_places import surface_points

Region = Literal["top", "slope", "side", "overhang", "bottom"]
NEAR = np.sin(np.radians(10.0))
"""Sine of the angle from upward, downward and level within which an axis belongs to a top, bottom or side."""
STEPS = 8
"""Iterations of closest points (ICP); each leaves a tenth of the shift of the one before, or less."""
UPRIGHT, FACING = 0.8, 0.7
"""Largest z of the normals of sides that are matched, and least cosine between those that match."""
TURN_MM = 3.0
"""Distance, mm, that counts as much as an angle of 60 degrees between normals, so that points near an edge
are matched with those of the same side."""
FARTHEST_MM, SIZE_MM, RMS_MM = 2.0, 1.5, 0.25
"""Distance of points without a match, mm; greatest difference of sizes, and root mean square of the distances
of sides in the end, mm: fuzzy skin of 0.5 mm leaves 0.07, a turn by 2 degrees 0.3 on 30 mm."""


def region_of(axis: Array) -> Region:
    """The kind of surface by its outward axis (3,), a unit vector."""
    up, level = float(axis[2]), float(np.hypot(axis[0], axis[1]))
    if level < NEAR:
        return "top" if up > 0.0 else "bottom"
    if abs(up) <= NEAR:
        return "side"
    return "slope" if up > 0.0 else "overhang"


def offset_of(shape: Body, body: Body, name: str = "the print") -> Array:
    """The translation (3,), mm, that takes an object, or another print of it, onto the shape of its beads.

    Slicers put parts on the bed where they like, but neither turn nor scale them unasked.

    Args:
        shape: of the beads (`relief.solids.filament.sliced_shape`).
        body: the object.
        name: of what the shape belongs to, for errors.

    Raises:
        InputError: the object is another one, is turned or scaled, or the beads print more than it.
    """
    boxes = [np.stack([each.vertices.min(axis=0), each.vertices.max(axis=0)]) for each in (shape, body)]
    sizes = [np.ptp(box, axis=0) for box in boxes]
    if np.abs(sizes[0] - sizes[1]).max() > SIZE_MM:
        printed, own = (" x ".join(f"{side:.1f}" for side in size) for size in sizes)
        raise InputError(
            f"measures {own} mm, {name} {printed} mm; both must be the same object, turned and scaled alike, "
            "and printed once"
        )
    offset = boxes[0].mean(axis=0) - boxes[1].mean(axis=0)
    offset[2] = boxes[0][0, 2] - boxes[1][0, 2]
    there, points = surface_points(shape), surface_points(body)
    tree = cKDTree(np.hstack([there.at, TURN_MM * there.normals]))
    side = np.abs(points.normals[:, 2]) < UPRIGHT
    at, normals = points.at[side], points.normals[side]
    for last in (False,) * STEPS + (True,):
        near = tree.query(np.hstack([at + offset, TURN_MM * normals]))[1]
        away = np.einsum("nc,nc->n", there.at[near] - at - offset, normals)
        alike = np.einsum("nc,nc->n", there.normals[near], normals) > FACING
        alike &= np.abs(away) < FARTHEST_MM
        if not last:
            offset[:2] += np.linalg.lstsq(normals[alike, :2], away[alike], rcond=1e-3)[0]
    rms = float(np.sqrt(np.mean(np.where(alike, away, FARTHEST_MM) ** 2))) if len(at) else 0.0
    if rms > RMS_MM:
        raise InputError(
            f"its sides lie {rms:.2f} mm (rms) from those of {name}; both must be the same object, turned "
            "alike"
        )
    return offset
