"""The smooth surface behind the facets of a body: creases, normals, and bulges over edges.

Programs that write facets put the corners on the surface of the design. On a round surface the sum of the
normals at both ends of an edge is perpendicular to the edge: exactly on planes and balls, and around
cylinders, and up to the third power of the length elsewhere. The normals minimise these products, in least
squares, near an initial guess.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import cg

from relief.ground.arrays import Array, Index, sums_by, units
from relief.ground.errors import naming
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs
from relief.solids.meshes.refining import refined
from relief.solids.remeshing.creases import crease_edges, directions, turns_at

RIM = np.radians(10.0)
"""Least angle, rad, at which the rim of a flat side is an edge of the part; at less a fillet may end
there."""
COPLANAR = np.radians(0.05)
"""Angle between facets of one plane, rad: rounding of files in single precision leaves less."""
WIDE = 3.0
"""Width of a plane against that of the facets beside it, from which the plane has the normal of both."""
POWER = 2.0
"""Power of the length that divides the weights of edges: the products are exact up to its third power."""
SLIVER = 4.0
"""Length of an edge, in the shortest of its triangle, from which it belongs to a sliver."""
NEAR = 1e-3
"""Weight of the initial normals, relative to that of the shortest edges of triangles: keeps slivers, whose
edges have little weight, from rotating normals."""
STEPS = 60
"""Most steps of conjugate gradients; the initial guess is good but for few places."""
EDGE_MM, MOST_FACES = 1.5, 600_000
"""Longest edge, mm, of the triangles on which an object is unrolled, and most of these triangles."""
LARGEST_BULGE = 0.12
"""Largest bulge over an edge, relative to its length: that of an arc of 55 degrees."""
SLIVER_BULGE = 0.5
"""Largest bulge over an edge of a facet, in the height of the wider facet beside: facets are no narrower than
what they leave out, and along a sliver a normal that leans by a degree would be 0.1 mm."""


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
    pairs = edge_pairs(body.faces)
    creases = crease_edges(body, pairs)
    if side is not None:
        rim = pairs[(side[pairs[:, 0] // 3] != side[pairs[:, 1] // 3]) & (turns_at(body, pairs) > RIM)]
        creases.reshape(-1)[rim.ravel()] = True
    group = corner_groups(body, pairs, creases)
    guess = _guess(body, pairs[~creases.ravel()[pairs[:, 0]]], group)
    normals = _fulfilled(body, group, guess)[group].reshape(-1, 3, 3)
    return SmoothSurface(body, creases, normals, bulges(body, pairs, creases, normals, facets=True))


@stage("finding the object's smooth surface")
def smooth_object(body: Body, name: object) -> Body:
    """The smooth surface behind the facets of an object, with edges of about 1.5 mm at most.

    `retouch wrap` lays textures on this surface. Over the facets of a file the same texture has their shape
    as well: of a mouse of 2,060 facets V was half a just-noticeable difference too large.

    Args:
        body: A closed body, each vertex once.
        name: Of its file, for messages.

    Raises:
        InputError: That takes too many faces.
    """
    with naming(name):
        fine = refined(body, EDGE_MM, most=MOST_FACES)
    parent, share = fine.vertex_parents(np.ones(len(body.faces), bool))
    return Body(fine.body.vertices + raised(smooth_surface(body).bulges, parent, share), fine.body.faces)


def corner_angles(body: Body) -> Array:
    """(faces, 3) angles at the corners, rad."""
    corners = body.vertices[body.faces]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    return np.arctan2(np.linalg.norm(np.cross(ahead, behind), axis=2), (ahead * behind).sum(axis=2))


def _planes(body: Body, pairs: Index, turns: Array) -> tuple[Index, Array]:
    """The plane each face belongs to, (faces,), and the widths of planes, twice area by circumference, mm."""
    plane = connected(pairs[turns < COPLANAR] // 3, len(body.faces))
    area = np.bincount(plane, body.areas)
    rim = pairs[turns >= COPLANAR]
    length = directions(body, rim[:, 0])[1]
    around = sum(np.bincount(plane[side // 3], length, len(area)) for side in rim.T)
    return plane, 2.0 * area / np.maximum(around, 1e-12)


def corner_groups(body: Body, pairs: Index, creases: NDArray[np.bool_]) -> Index:
    """(faces * 3,) numbers of the normals of corners: one for all around a vertex between its creases."""
    one, other = pairs[~creases.ravel()[pairs[:, 0]]].T
    after = lambda half: half - half % 3 + (half + 1) % 3  # noqa: E731
    ends = np.concatenate([one, after(one)]), np.concatenate([after(other), other])
    return connected(np.stack(ends, axis=1), 3 * len(body.faces))


def _guess(body: Body, pairs: Index, group: Index) -> Array:
    """Normals (groups, 3): means by angles; beside a wide plane, which is no facet, that of the plane.

    Args:
        body: The body.
        pairs: (n, 2) half-edges on both sides of the edges that are no creases.
        group: As of `_groups`.
    """
    plane, width = _planes(body, pairs, turns_at(body, pairs))
    unit, weight = units(body.normals), corner_angles(body).ravel()
    count, planes = int(group.max()) + 1, len(width)
    own = group * planes + np.repeat(plane, 3)
    length = directions(body, np.arange(3 * len(plane)))[1]
    height = 2.0 * np.repeat(body.areas, 3) / np.maximum(length, 1e-12)
    wide = []
    rim = pairs[plane[pairs[:, 0] // 3] != plane[pairs[:, 1] // 3]]
    for one, other in (rim.T, rim.T[::-1]):
        halves = one[width[plane[one // 3]] > WIDE * height[other]]
        wide += [own[halves], own[halves - halves % 3 + (halves + 1) % 3]]
    kept = np.isin(own, np.concatenate(wide))
    any_wide = np.zeros(count, bool)
    any_wide[group[kept]] = True
    weight[any_wide[group] & ~kept] = 0.0
    return units(sums_by(group, weight[:, None] * np.repeat(unit, 3, axis=0), count))


def _fulfilled(body: Body, group: Index, guess: Array) -> Array:
    """Normals (groups, 3) near a guess whose sums at both ends of edges are perpendicular to the edges."""
    halves = np.arange(len(group))
    ahead = halves - halves % 3 + (halves + 1) % 3
    way, length = directions(body, halves)
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
    # Along slivers normals turn as in the guess: else the short edges at their ends would make them lean.
    sliver = np.clip(1.0 - SLIVER * shortest[used] / length[used], 0.0, None)[:, None]
    leaning = np.concatenate([sliver * way[used], -sliver * way[used]], axis=1).ravel()
    along = sp.csr_matrix((leaning, (rows, columns)), matrix.shape)
    # Turned alone: normals that may grow shorter would fulfil everything at 0.
    across = units(np.cross(guess, np.eye(3)[np.argmin(np.abs(guess), axis=1)]))
    turns = np.stack([across, np.cross(guess, across)], axis=2)
    number = np.arange(guess.size)
    places = 2 * (number // 3)[:, None] + np.arange(2)
    tangents = sp.csr_matrix(
        (turns.ravel(), (np.repeat(number, 2), places.ravel())), (guess.size, 2 * len(guess))
    )
    by_turns = matrix @ tangents
    lean = along @ tangents
    square = by_turns.T @ by_turns + lean.T @ lean + NEAR * sp.eye_array(2 * len(guess))
    change, _ = cg(square, -(by_turns.T @ (matrix @ guess.ravel())), rtol=1e-4, maxiter=STEPS)
    return units(guess + (tangents @ change).reshape(-1, 3))


def bulges(
    body: Body, pairs: Index, creases: NDArray[np.bool_], normals: Array, facets: bool = False
) -> Array:
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
    sides = np.linalg.norm(way, axis=2)
    length, limit = np.linalg.norm(flat, axis=1), 4.0 * LARGEST_BULGE * sides.ravel()
    if facets:
        height = np.repeat(2.0 * body.areas / np.maximum(sides.max(axis=1), 1e-12), 3)
        height[pairs] = height[pairs].max(axis=1)[:, None]
        limit = np.minimum(limit, 4.0 * SLIVER_BULGE * height)
    flat *= np.minimum(1.0, limit / np.maximum(length, 1e-12))[:, None]
    return flat.reshape(-1, 3, 3)
