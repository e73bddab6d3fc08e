"""Flips of edges towards Delaunay's triangles, many at once, which share no vertex of four."""

import numpy as np

from relief.ground.arrays import Array, Flags, Index, flagged, units
from relief.solids.meshes.neighbourhood import among, edge_ends, edge_keys, edge_pairs
from relief.solids.remeshing.triangles import Triangles

TURN = np.cos(np.radians(40.0))
"""Cosine of the angle by which a flip may turn a triangle."""
LEAST_GAIN = 1e-7
"""Least gain of a flip, in sines: flips between equal pairs would never end."""


class Flips:
    """Passes of flips over triangles, without other changes between passes.

    Attributes:
        triangles: Changed in place.
    """

    def __init__(self, triangles: Triangles) -> None:
        self.triangles = triangles
        self._turned: Flags | None = None

    def flip(self) -> int:
        """Flip edges towards Delaunay's triangles where the surface turns little; returns how many.

        After the first call only edges of triangles that were flipped, or waited for flips beside them, are
        checked.
        """
        faces, (pairs, edges) = self.triangles.faces, self._flippable()
        one, other = pairs[:, 0] // 3, pairs[:, 1] // 3
        a, b = faces.ravel()[pairs[:, 0]], faces[one, (pairs[:, 0] + 1) % 3]
        c, d = faces[one, (pairs[:, 0] + 2) % 3], faces[other, (pairs[:, 1] + 2) % 3]
        gain = _beyond_delaunay(self.triangles.vertices, a, b, c, d)
        rows = np.flatnonzero(gain > LEAST_GAIN)
        gain = gain[rows]
        one, other, a, b, c, d = (values[rows] for values in (one, other, a, b, c, d))
        before = self._unit(a, b, c), self._unit(b, a, d)
        after = self._unit(a, d, c), self._unit(d, b, c)
        middle = before[0] + before[1]
        length = np.linalg.norm(middle, axis=1)
        sound = ((before[0] * before[1]).sum(1) > TURN) | (length == 0.0)
        for normal in after:
            sound &= (normal * middle).sum(1) > TURN * np.maximum(length, 1e-12)
        new = edge_keys(c, d)
        sound &= ~among(new, edges) & ~among(new, self.triangles.taken) & (c != d)
        order = np.flatnonzero(sound)
        self._turned = flagged(np.concatenate([one[order], other[order]]), len(faces))
        order = order[np.argsort(-gain[order], kind="stable")]
        # One flip for the four triangles' vertices each, so that no two make one edge.
        best = np.full(len(faces), len(order))
        rank = np.arange(len(order))
        for face in (one[order], other[order]):
            np.minimum.at(best, face, rank)
        order = order[(best[one[order]] == rank) & (best[other[order]] == rank)]
        order = order[np.sort(np.unique(new[order], return_index=True)[1])]
        faces[one[order]] = np.stack([a, d, c], axis=1)[order]
        faces[other[order]] = np.stack([d, b, c], axis=1)[order]
        return len(order)

    def _flippable(self) -> tuple[Index, Index]:
        """Half-edges (k, 2) on both sides of edges that may be flipped, and keys of all edges near them."""
        triangles, turned = self.triangles, self._turned
        some = np.arange(len(triangles.faces))
        if turned is None:
            turned = np.ones(len(some), bool)
        else:
            for least in (2, 1):
                ends = flagged(triangles.faces[turned if least == 2 else some], len(triangles.vertices))
                some = np.flatnonzero(triangles.count(ends) >= least)
        faces = triangles.faces[some]
        pairs = edge_pairs(faces)
        keys = edge_keys(*edge_ends(faces))
        kept = ~among(keys[pairs[:, 0]], triangles.held)
        pairs = 3 * some[pairs[kept] // 3] + pairs[kept] % 3
        return pairs[turned[pairs[:, 0] // 3] | turned[pairs[:, 1] // 3]], np.sort(keys)

    def _unit(self, a: Index, b: Index, c: Index) -> Array:
        """Unit normals (n, 3) of triangles by their corners; 0 where they have no area."""
        vertices = self.triangles.vertices
        return units(np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]))


def _beyond_delaunay(vertices: Array, a: Index, b: Index, c: Index, d: Index) -> Array:
    """Negative sine of the sum of the angles at c and d, opposite to an edge a-b; above 0: not Delaunay's."""

    def angle(at: Index) -> tuple[Array, Array]:
        one, two = vertices[a] - vertices[at], vertices[b] - vertices[at]
        scale = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
        scale = np.where(scale > 0.0, scale, 1.0)
        return (one * two).sum(axis=1) / scale, np.linalg.norm(np.cross(one, two), axis=1) / scale

    (cos_c, sin_c), (cos_d, sin_d) = angle(c), angle(d)
    return np.asarray(-(sin_c * cos_d + cos_c * sin_d))
