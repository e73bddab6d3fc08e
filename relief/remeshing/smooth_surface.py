"""The smooth surface behind the facets of a body: creases, normals, and how far it bulges over an edge.

Programs that write facets put their corners on the surface that is meant. On a round surface the sum of the
normals at both ends of an edge is perpendicular to the edge: exactly on planes and balls, and around
cylinders, and up to the third power of the length elsewhere. So the normals are those that fulfil this best
near a first guess.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import cg

from relief.body import Body
from relief.common.arrays import Array, Index
from relief.meshes.neighbourhood import edge_pairs

SHARPEST = np.radians(40.0)
"""Angle between two facets, rad, from which their edge is one of the part: coarse files have facets of 30
degrees."""
SMOOTHEST = np.radians(2.0)
"""Angle between two facets, rad, up to which their edge is none of the part."""
RIM = np.radians(10.0)
"""Angle, rad, from which the rim of a flat side that stays is an edge of the part; a fillet may end there."""
SUPPORT = 2.5
"""Angle at an edge of the part against those at the edges beside, from which facets do not explain it. In the
middle of a fillet of two facets the angle is twice that beside."""
PARALLEL = np.cos(np.radians(35.0))
"""Cosine of the widest angle between an edge and those beside it that explain it."""
BESIDE = 4
"""Triangles away that edges may lie to explain one: facets of a strip or a cell are one to three."""
AT_ONCE = 1 << 15
"""Edges looked at together, which bounds the memory."""
COPLANAR = np.radians(0.05)
"""Angle between facets of one plane, rad: rounding of files in single precision leaves less."""
WIDE = 3.0
"""Width of a plane against that of the facets beside it, from which the plane has the normal of both."""
POWER = 2.0
"""Power of the length by which edges count less: the sums are perpendicular up to its third power."""
NEAR = 1e-3
"""Weight of staying near the guess, in that of the shortest edges of triangles: long thin ones, which fulfil
little, then turn nothing."""
STEPS = 60
"""Steps of conjugate gradients; the guess is off at few places, and near."""
LARGEST_BULGE = 0.12
"""Largest bulge over an edge, as a part of its length: over an arc of 55 degrees."""


@dataclass(frozen=True)
class SmoothSurface:
    """A body of facets and the smooth surface through its vertices.

    Attributes:
        body: Of facets.
        creases: (faces, 3) whether the edge from corner k to corner k + 1 is an edge of the part.
        normals: (faces, 3, 3) outward unit normals at the corners, on the face's side of creases.
        bulges: (faces, 3, 3) four times the way from the middle of edge k to the smooth surface, mm.
    """

    body: Body
    creases: NDArray[np.bool_]
    normals: Array
    bulges: Array

    def normals_at(self, face: Index, share: Array) -> Array:
        """Unit normals (n, 3) at barycentric coordinates (n, 3) in faces (n,)."""
        return units(np.einsum("nc,ncd->nd", share, self.normals[face]))

    def places_at(self, face: Index, share: Array) -> Array:
        """Points (n, 3) of the smooth surface at barycentric coordinates (n, 3) in faces (n,), mm."""
        flat = np.einsum("nc,ncd->nd", share, self.body.vertices[self.body.faces[face]])
        return np.asarray(flat + raised(self.bulges, face, share))


def raised(bulges: Array, face: Index, share: Array) -> Array:
    """Ways (n, 3) from faces (n,) at barycentric coordinates (n, 3) to the smooth surface, mm."""
    return np.einsum("nc,ncd->nd", share * np.roll(share, -1, axis=1), bulges[face])


def smooth_surface(body: Body, side: NDArray[np.bool_] | None = None) -> SmoothSurface:
    """The smooth surface behind the facets of a body.

    Args:
        body: A closed body, each vertex once.
        side: (faces,) facets of a flat side, whose rim is an edge of the part; None: there is none.
    """
    pairs = edge_pairs(body.faces, len(body.vertices))
    creases = crease_edges(body, pairs)
    if side is not None:
        rim = pairs[(side[pairs[:, 0] // 3] != side[pairs[:, 1] // 3]) & (_turns(body, pairs) > RIM)]
        creases.reshape(-1)[rim.ravel()] = True
    group = corner_groups(body, pairs, creases)
    normals = _fulfilled(body, group, _guess(body, pairs[~creases.ravel()[pairs[:, 0]]], group))[
        group
    ].reshape(-1, 3, 3)
    return SmoothSurface(body, creases, normals, bulges(body, pairs, creases, normals))


def units(vectors: Array) -> Array:
    """Vectors (..., 3) of length 1; 0 where they have none."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


def corner_angles(body: Body) -> Array:
    """(faces, 3) angles at the corners, rad."""
    corners = body.vertices[body.faces]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2))


def _turns(body: Body, pairs: Index) -> Array:
    """(n,) angles between the facets on both sides of edges, rad."""
    unit = units(body.normals)
    one, other = unit[pairs[:, 0] // 3], unit[pairs[:, 1] // 3]
    return np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))


def _directions(body: Body, halves: Index) -> tuple[Array, Array]:
    """Unit vectors (n, 3) along half-edges, and their lengths (n,), mm."""
    faces = body.faces
    way = body.vertices[faces[halves // 3, (halves + 1) % 3]] - body.vertices[faces.ravel()[halves]]
    return units(way), np.linalg.norm(way, axis=1)


def _planes(body: Body, pairs: Index, turns: Array) -> tuple[Index, Array]:
    """The plane each face belongs to, (faces,), and the widths of planes, twice area by circumference, mm."""
    count = len(body.faces)
    one, other = pairs[turns < COPLANAR].T // 3
    graph = sp.coo_matrix((np.ones(len(one), np.int8), (one, other)), (count, count))
    number, plane = connected_components(graph, directed=False)
    area = np.bincount(plane, body.areas, number)
    rim = pairs[turns >= COPLANAR]
    length = _directions(body, rim[:, 0])[1]
    around = sum(np.bincount(plane[side // 3], length, number) for side in rim.T)
    return plane, 2.0 * area / np.maximum(around, 1e-12)


def crease_edges(body: Body, pairs: Index) -> NDArray[np.bool_]:
    """(faces, 3) edges of the part: sharp ones, and those whose angle no edge beside them explains."""
    turns = _turns(body, pairs)
    sharp = turns >= SHARPEST
    doubtful = np.flatnonzero((turns > SMOOTHEST) & ~sharp)
    for start in range(0, len(doubtful), AT_ONCE):
        part = doubtful[start : start + AT_ONCE]
        sharp[part] = turns[part] > SUPPORT * _support(body, pairs, turns, part)
    creases = np.zeros(3 * len(body.faces), bool)
    creases[pairs[sharp].ravel()] = True
    return creases.reshape(-1, 3)


def _support(body: Body, pairs: Index, turns: Array, chosen: Index) -> Array:
    """(n,) greatest angle at the edges beside chosen ones: parallel, and a few triangles away."""
    flat = body.faces.ravel()
    twin, turn = np.full(len(flat), -1), np.zeros(len(flat))
    twin[pairs[:, 0]], twin[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
    turn[pairs] = np.where(turns < SHARPEST, turns, 0.0)[:, None]
    way = _directions(body, pairs[chosen, 0])[0]
    ends = flat[pairs[chosen]]
    support = np.zeros(len(chosen))
    number = np.tile(np.arange(len(chosen)), 2)
    half = pairs[chosen].T.ravel()
    for step in range(BESIDE):
        number = np.tile(number, 2)
        half = np.concatenate([half - half % 3 + (half + add) % 3 for add in (1, 2)])
        parallel = np.abs((_directions(body, half)[0] * way[number]).sum(axis=1)) > PARALLEL
        if step > 0:
            # Edges that go on in the same line have the same angle and explain nothing.
            ahead = half - half % 3 + (half + 1) % 3
            parallel &= ~(flat[half][:, None] == ends[number]).any(axis=1)
            parallel &= ~(flat[ahead][:, None] == ends[number]).any(axis=1)
        np.maximum.at(support, number[parallel], turn[half[parallel]])
        half = twin[half]
        number, half = number[half >= 0], half[half >= 0]
    return support


def corner_groups(body: Body, pairs: Index, creases: NDArray[np.bool_]) -> Index:
    """(faces * 3,) numbers of the normals of corners: one for all around a vertex between its creases."""
    one, other = pairs[~creases.ravel()[pairs[:, 0]]].T
    after = lambda half: half - half % 3 + (half + 1) % 3  # noqa: E731
    ends = np.concatenate([one, after(one)]), np.concatenate([after(other), other])
    count = 3 * len(body.faces)
    graph = sp.coo_matrix((np.ones(len(ends[0]), np.int8), ends), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.int64)


def _guess(body: Body, pairs: Index, group: Index) -> Array:
    """Normals (groups, 3): means by angles; beside a wide plane, which is no facet, that of the plane.

    Args:
        body: The body.
        pairs: (n, 2) half-edges on both sides of the edges that are no creases.
        group: As of `_groups`.
    """
    plane, width = _planes(body, pairs, _turns(body, pairs))
    unit, weight = units(body.normals), corner_angles(body).ravel()
    count, planes = int(group.max()) + 1, len(width)
    own = group * planes + np.repeat(plane, 3)
    height = (
        2.0 * np.repeat(body.areas, 3) / np.maximum(_directions(body, np.arange(3 * len(plane)))[1], 1e-12)
    )
    wide = []
    rim = pairs[plane[pairs[:, 0] // 3] != plane[pairs[:, 1] // 3]]
    for one, other in (rim.T, rim.T[::-1]):
        halves = one[width[plane[one // 3]] > WIDE * height[other]]
        wide += [own[halves], own[halves - halves % 3 + (halves + 1) % 3]]
    kept = np.isin(own, np.concatenate(wide))
    any_wide = np.zeros(count, bool)
    any_wide[group[kept]] = True
    weight[any_wide[group] & ~kept] = 0.0
    columns = [np.bincount(group, weight * np.repeat(unit[:, k], 3), count) for k in range(3)]
    return units(np.stack(columns, axis=1))


def _fulfilled(body: Body, group: Index, guess: Array) -> Array:
    """Normals (groups, 3) near a guess whose sums at both ends of edges are perpendicular to the edges."""
    halves = np.arange(len(group))
    ahead = halves - halves % 3 + (halves + 1) % 3
    way, length = _directions(body, halves)
    one, other = group[halves], group[ahead]
    used = length > 0.0
    rows = np.repeat(np.arange(used.sum()), 6)
    columns = np.concatenate(
        [3 * one[used, None] + np.arange(3), 3 * other[used, None] + np.arange(3)], axis=1
    ).ravel()
    shortest = np.repeat(np.where(used, length, np.inf).reshape(-1, 3).min(axis=1), 3)
    weight = (shortest[used] / length[used])[:, None] ** POWER
    values = np.concatenate([weight * way[used]] * 2, axis=1).ravel()
    matrix = sp.csr_matrix((values, (rows, columns)), (int(used.sum()), guess.size))
    # Turned alone: normals that may grow shorter would fulfil everything at 0.
    across = units(np.cross(guess, np.eye(3)[np.argmin(np.abs(guess), axis=1)]))
    turns = np.stack([across, np.cross(guess, across)], axis=2)
    number = np.arange(guess.size)
    places = 2 * (number // 3)[:, None] + np.arange(2)
    tangents = sp.csr_matrix(
        (turns.ravel(), (np.repeat(number, 2), places.ravel())), (guess.size, 2 * len(guess))
    )
    by_turns = matrix @ tangents
    square = by_turns.T @ by_turns + NEAR * sp.eye_array(2 * len(guess))
    change, _ = cg(square, -(by_turns.T @ (matrix @ guess.ravel())), rtol=1e-4, maxiter=STEPS)
    return units(guess + (tangents @ change).reshape(-1, 3))


def bulges(body: Body, pairs: Index, creases: NDArray[np.bool_], normals: Array) -> Array:
    """(faces, 3, 3) as in `SmoothSurface`: by the normals at the ends, on creases by those of both sides."""
    faces = body.faces
    corners = body.vertices[faces]
    way = np.roll(corners, -1, axis=1) - corners
    ahead = np.roll(normals, -1, axis=1)
    # Half of the quadratic surface through both tangent planes (Boubekeur and Alexa 2008).
    bulge = 0.5 * (
        (way * ahead).sum(axis=2, keepdims=True) * ahead
        - (way * normals).sum(axis=2, keepdims=True) * normals
    )
    flat, mean = bulge.reshape(-1, 3), units(normals + ahead).reshape(-1, 3)
    sharp = pairs[creases.ravel()[pairs[:, 0]]]
    one, other = sharp.T
    # The bulge of a crease is perpendicular to it and has the height of both surfaces.
    heights = np.stack([(flat[side] * mean[side]).sum(axis=1) for side in (one, other)], axis=1)
    both = np.stack([mean[one], mean[other]], axis=1)
    solved = np.einsum("nij,nj->ni", np.linalg.pinv(both, rcond=0.2), heights)
    flat[one] = flat[other] = solved
    length, limit = np.linalg.norm(flat, axis=1), 4.0 * LARGEST_BULGE * np.linalg.norm(way, axis=2).ravel()
    flat *= np.minimum(1.0, limit / np.maximum(length, 1e-12))[:, None]
    return flat.reshape(-1, 3, 3)
