"""Where a CAD object lies among the beads that a slicer made of it, and the regions of a sliced part."""

from collections.abc import Iterator
from itertools import permutations, product
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, units
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
of sides in the end, mm: fuzzy skin of 0.5 mm leaves 0.13, two such 0.19, a turn by 2 degrees 0.3 on 30 mm."""
MOST_POINTS, EVENED, FEWER = 20_000, 32, 8
"""Most points on a body; the nearest ones that even out a normal, as fuzzy skin tilts faces by 45 degrees and
more; and one of how many is taken for an object that is turned."""
PLAIN_MM, BETTER = 0.03, 0.8
"""Distance of sides, mm, up to which an object is the right one, as plain sides leave 0.02; and the share of
a larger distance below which the object turned or mirrored fits better. A handle that is nearly the same
after a quarter turn has 0.08 then, and V of 0.018 for 0.0015."""


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
        InputError: the object is another one, is turned, mirrored or scaled, or the beads print more than it.
    """
    boxes = [np.stack([each.vertices.min(axis=0), each.vertices.max(axis=0)]) for each in (shape, body)]
    sizes = [np.ptp(box, axis=0) for box in boxes]
    if np.abs(sizes[0] - sizes[1]).max() > SIZE_MM:
        printed, mine = (" x ".join(f"{side:.1f}" for side in size) for size in sizes)
        raise InputError(
            f"measures {mine} mm, {name} {printed} mm; both must be the same object, turned and scaled "
            "alike, and printed once"
        )
    # Bottoms lie together: the highest layer leaves a part of the object out.
    at = [np.append(box[:, :2].mean(axis=0), box[0, 2] + 0.5 * sizes[0][2]) for box in boxes]
    there, own = (_points_on(each, start) for each, start in zip((shape, body), at, strict=True))
    shift, rms = _fitted(there, own)
    must = "both must be the same object, turned alike"
    if rms > RMS_MM:
        raise InputError(f"its sides lie {rms:.2f} mm (rms) from those of {name}; {must}")
    if rms > PLAIN_MM:
        apart = [_fitted(there, other)[1] for other in _turned(own[:, ::FEWER])]
        if min(apart) < BETTER * apart[0]:
            raise InputError(f"fits {name} better when it is turned by right angles or mirrored; {must}")
    return at[0] - at[1] + shift


def _points_on(body: Body, middle: Array) -> Array:
    """Points (2, k, 3) on a body, from its middle, mm, and normals in which fuzzy skin is evened out."""
    points = surface_points(body)
    some = slice(None, None, -(-len(points.at) // MOST_POINTS))
    at, normals = points.at[some], points.normals[some]
    near = normals[cKDTree(at).query(at, EVENED)[1]]
    # The other side of a thin wall counts nothing.
    weights = np.einsum("knc,kc->kn", near, normals).clip(min=0.0)
    return np.stack([at - middle, units(np.einsum("knc,kn->kc", near, weights))])


def _turned(points: Array) -> Iterator[Array]:
    """Points and normals (2, k, 3) as they are, then turned by right angles, z upright, and mirrored."""
    for (x, y), signs in product(permutations((0, 1)), product((1.0, -1.0), repeat=3)):
        yield points[:, :, (x, y, 2)] * signs


def _fitted(there: Array, points: Array) -> tuple[Array, float]:
    """The shift (3,) mm along x and y that takes points onto a shape's, and the rms distance of sides, mm."""
    tree = cKDTree(np.hstack([there[0], TURN_MM * there[1]]))
    at, normals = points[:, np.abs(points[1, :, 2]) < UPRIGHT]
    offset = np.zeros(3)
    for last in (False,) * STEPS + (True,):
        near = tree.query(np.hstack([at + offset, TURN_MM * normals]))[1]
        away = np.einsum("nc,nc->n", there[0, near] - at - offset, normals)
        alike = np.einsum("nc,nc->n", there[1, near], normals) > FACING
        alike &= np.abs(away) < FARTHEST_MM
        if not last:
            offset[:2] += np.linalg.lstsq(normals[alike, :2], away[alike], rcond=1e-3)[0]
    rms = float(np.sqrt(np.mean(np.where(alike, away, FARTHEST_MM) ** 2))) if len(at) else 0.0
    return offset, rms
