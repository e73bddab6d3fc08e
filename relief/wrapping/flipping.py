"""Better triangles on flat parts: edges between triangles of one plane flipped until they are Delaunay's."""

import numpy as np
from numpy.typing import NDArray

from relief.body import Body
from relief.common.arrays import Array
from relief.meshes.neighbourhood import edge_pairs
from relief.meshes.refining import refined

FLAT = np.cos(np.radians(0.5))
"""Cosine of the largest angle between the normals of two triangles that count as one plane."""
MOST_ROUNDS = 60
"""Rounds of flips; few flips are left by then."""
ROUNDING = 1e-9
"""Least gain of a flip, in sines: flips between equal pairs would never end."""


def even_triangles(body: Body, edge_mm: float) -> Body:
    """Divide triangles down to an edge, and flip edges inside of planes, so that few triangles are thin.

    The surface stays where it is.

    Args:
        body: A closed body, each vertex once.
        edge_mm: Longest edge allowed, mm.
    """
    for edge in (8.0 * edge_mm, 2.0 * edge_mm, edge_mm):
        body = flipped(refined(flipped(body), edge).body)
    return refined(body, edge_mm).body


def flipped(body: Body) -> Body:
    """A body after flips of edges between triangles of one plane; see `even_triangles`."""
    faces = body.faces.copy()
    for _ in range(MOST_ROUNDS):
        if not _flip(body.vertices, faces):
            break
    return Body(body.vertices, faces)


def _flip(vertices: Array, faces: NDArray[np.intp]) -> int:
    """Flip edges that share no triangle, in place; returns their number."""
    pairs = edge_pairs(faces, len(vertices))
    one, other = pairs[:, 0] // 3, pairs[:, 1] // 3
    a, b = faces.ravel()[pairs[:, 0]], faces[one, (pairs[:, 0] + 1) % 3]
    c = faces[one, (pairs[:, 0] + 2) % 3]
    d = faces[other, (pairs[:, 1] + 2) % 3]
    normal = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
    opposite = np.cross(vertices[a] - vertices[b], vertices[d] - vertices[b])
    lengths = np.linalg.norm(normal, axis=1) * np.linalg.norm(opposite, axis=1)
    gain = _cotangents(vertices, a, b, c, d)
    wanted = (gain > ROUNDING) & ((normal * opposite).sum(axis=1) >= FLAT * lengths) & (lengths > 0.0)
    # The flipped edge must not be there already, as in a tetrahedron.
    keys = np.minimum(a, b) * len(vertices) + np.maximum(a, b)
    wanted &= ~np.isin(np.minimum(c, d) * len(vertices) + np.maximum(c, d), keys)
    chosen = np.flatnonzero(wanted)
    if not len(chosen):
        return 0
    best = np.full(len(faces), -1.0)
    np.maximum.at(best, one[chosen], gain[chosen])
    np.maximum.at(best, other[chosen], gain[chosen])
    chosen = chosen[(gain[chosen] == best[one[chosen]]) & (gain[chosen] == best[other[chosen]])]
    # Of equal gains in one triangle the first stays, and of equal new edges.
    seen = np.full(len(faces), len(pairs))
    np.minimum.at(seen, one[chosen], chosen)
    np.minimum.at(seen, other[chosen], chosen)
    chosen = chosen[(seen[one[chosen]] == chosen) & (seen[other[chosen]] == chosen)]
    new = np.minimum(c, d)[chosen] * len(vertices) + np.maximum(c, d)[chosen]
    chosen = chosen[np.unique(new, return_index=True)[1]]
    faces[one[chosen]] = np.stack([a, d, c], axis=1)[chosen]
    faces[other[chosen]] = np.stack([d, b, c], axis=1)[chosen]
    return len(chosen)


def _cotangents(
    vertices: Array, a: NDArray[np.intp], b: NDArray[np.intp], c: NDArray[np.intp], d: NDArray[np.intp]
) -> Array:
    """Negative sine of the sum of the angles at c and d, opposite to an edge a-b; above 0: not Delaunay's."""

    def angle(at: NDArray[np.intp]) -> tuple[Array, Array]:
        one, two = vertices[a] - vertices[at], vertices[b] - vertices[at]
        scale = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
        scale = np.where(scale > 0.0, scale, 1.0)
        return (one * two).sum(axis=1) / scale, np.linalg.norm(np.cross(one, two), axis=1) / scale

    (cos_c, sin_c), (cos_d, sin_d) = angle(c), angle(d)
    return np.asarray(-(sin_c * cos_d + cos_c * sin_d))
