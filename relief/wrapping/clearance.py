"""How far a surface may be moved along its normals before it meets itself."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from relief.body import Body
from relief.common.arrays import Array

SAFE = 0.7
"""Part of the radius of the empty ball that a displacement may use; the rest is for the facets of a mesh."""
MOST_ROUNDS = 30
"""Shrinkings of a ball; ten are usual."""


def smooth_normals(body: Body, ignored: NDArray[np.bool_] | None = None) -> Array:
    """Normals at the vertices, (n, 3): means over the triangles around, by their angles.

    Args:
        body: A closed body.
        ignored: (faces,) triangles that count only where a vertex has no others: those of a flat bottom.
    """
    corners = body.vertices[body.faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    unit = _units(np.cross(ahead[:, 0], behind[:, 0]))
    sine = np.linalg.norm(np.cross(ahead, behind), axis=2)
    angle = np.arctan2(sine, (ahead * behind).sum(axis=2))
    if ignored is not None:
        angle[ignored] *= 1e-9
    count = len(body.vertices)
    return _units(_sum_at(body.faces, angle[:, :, None] * unit[:, None, :], count))


def clearance(body: Body, normals: Array, most_mm: float) -> Array:
    """Radius of the largest ball that touches the surface from outside at each vertex, (n,) mm.

    Displacements along the normals that are shorter than that radius do not meet one another: each point
    stays inside of its own empty ball. In a hollow that is the radius of curvature, in a gap half its width.
    With the normals turned round, curvature and thickness count as seen from inside.

    Args:
        body: Vertices are the points of the surface; balls are empty of them.
        normals: (n, 3) unit normals, on the side of the balls.
        most_mm: Radius that is large enough.
    """
    tree = cKDTree(body.vertices)
    radii = np.full(len(body.vertices), most_mm)
    active = np.arange(len(radii))
    for _ in range(MOST_ROUNDS):
        own, normal = body.vertices[active], normals[active]
        distance, nearest = tree.query(own + radii[active, None] * normal)
        inside = distance < radii[active] * (1.0 - 1e-6)
        active, nearest, own, normal = active[inside], nearest[inside], own[inside], normal[inside]
        if not len(active):
            break
        way = body.vertices[nearest] - own
        along = (way * normal).sum(axis=1)
        smaller = (way**2).sum(axis=1) / np.maximum(2.0 * along, 1e-12)
        radii[active] = np.minimum(radii[active] * (1.0 - 1e-6), smaller)
    return radii


def clearance_factor(body: Body, normals: Array, out_mm: float, in_mm: float) -> Array:
    """Factor in [0, 1] at each vertex, (n,), by which displacements are lowered so that none can meet.

    Args:
        body: The body.
        normals: (n, 3) outward unit normals.
        out_mm: Farthest displacement outward, mm.
        in_mm: Farthest displacement inward, mm.
    """
    factor = np.ones(len(body.vertices))
    for side, need in ((1.0, out_mm), (-1.0, in_mm)):
        if need > 0.0:
            radius = clearance(body, side * normals, need / SAFE * 1.01)
            factor = np.minimum(factor, SAFE * radius / need)
    return np.minimum(factor, 1.0)


def _sum_at(index: NDArray[np.intp], values: Array, count: int) -> Array:
    """Sums (count, 3) of values (m, 3, 3) at the vertices (m, 3)."""
    flat = index.ravel()
    columns = [
        np.bincount(flat, values[..., axis].ravel(), minlength=count) for axis in range(values.shape[-1])
    ]
    return np.stack(columns, axis=1)


def _units(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)
