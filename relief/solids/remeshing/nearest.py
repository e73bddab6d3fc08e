"""Nearest points of a surface, by walks from triangle to triangle from initial guesses."""

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, Index, runs
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs, nearest_in, twins

GUESSES = 6
"""Samples near a point whose faces are tried first; slivers side by side have their samples side by side."""
MOST_STEPS = 100
"""Triangles that are crossed at most."""
CORNER = 1e-6
"""Largest barycentric distance from a corner of a point that counts as at the corner."""
AT_ONCE = 1 << 16
"""Points computed together, which bounds the memory."""


class NearestPoints:
    """Nearest points of a body, each within its region.

    Attributes:
        corners: (faces, 3, 3) mm.
        region: (faces,) numbers of the parts of the surface between held edges.
    """

    def __init__(self, body: Body, held: Flags, spacing_mm: float) -> None:
        """Take samples of the faces.

        Args:
            body: The surface.
            held: (faces, 3) edges that no point crosses.
            spacing_mm: Distance of the samples along thin triangles, mm.
        """
        self.corners = body.vertices[body.faces]
        pairs = edge_pairs(body.faces)
        pairs = pairs[~held.ravel()[pairs[:, 0]]]
        self.region = connected(pairs // 3, len(body.faces))
        self._twin = twins(pairs, 3 * len(body.faces)).reshape(-1, 3)
        self._vertices = body.faces
        self._around = np.argsort(body.faces.ravel(), kind="stable") // 3
        self._last = np.cumsum(np.bincount(body.faces.ravel(), minlength=len(body.vertices)))
        self._sampled, points = _samples(self.corners, spacing_mm)
        self._tree = cKDTree(points)

    def at(self, points: Array, face: Index) -> tuple[Index, Array]:
        """Faces (n,) of the nearest points and their barycentric coordinates (n, 3).

        Args:
            points: (n, 3) mm.
            face: (n,) a face of the region of each point, not far from it.
        """
        found, shares = face.copy(), np.empty((len(points), 3))
        for start in range(0, len(points), AT_ONCE):
            rows = slice(start, start + AT_ONCE)
            found[rows], shares[rows] = self._some(points[rows], face[rows])
        return found, shares

    def places(self, face: Index, share: Array) -> Array:
        """Points (n, 3) at barycentric coordinates (n, 3) in faces (n,), mm."""
        return np.einsum("nc,ncd->nd", share, self.corners[face])

    def _some(self, points: Array, face: Index) -> tuple[Index, Array]:
        samples, region = self._tree.query(points, GUESSES)[1], self.region[face]
        best, share = face.copy(), np.empty((len(points), 3))
        share[:], square = nearest_in(points, self.corners[face])
        for guess in self._sampled[samples].T:
            own = np.flatnonzero((self.region[guess] == region) & (guess != best))
            self._better(own, guess[own], points, best, share, square)
        active = np.arange(len(points))
        while len(active):
            self._walk(points, best, share, square, active)
            active = self._around_corners(points, best, share, square, active)
        return best, share

    def _around_corners(
        self, points: Array, best: Index, share: Array, square: Array, active: Index
    ) -> Index:
        """Go on around corners that are nearest so far: no triangle beside need be nearer, but one beyond."""
        active = active[share[active].max(axis=1) > 1.0 - CORNER]
        vertex = self._vertices[best[active], np.argmax(share[active], axis=1)]
        count = np.diff(self._last, prepend=0)[vertex]
        number, place = runs(count, self._last[vertex] - count)
        own, guess = active[number], self._around[place]
        same = self.region[guess] == self.region[best[own]]
        own, guess = own[same], guess[same]
        distance = nearest_in(points[own], self.corners[guess])[1]
        order = np.lexsort((distance, own))
        order = order[np.diff(own[order], prepend=-1) > 0]
        return self._better(own[order], guess[order], points, best, share, square)

    def walk_from(self, points: Array, face: Index) -> tuple[Index, Array]:
        """The same by a walk from one face, which stays on its side of held edges."""
        best = face.copy()
        share, square = nearest_in(points, self.corners[face])
        self._walk(points, best, share, square, np.arange(len(points)))
        return best, share

    def _walk(self, points: Array, best: Index, share: Array, square: Array, active: Index) -> None:
        """Go on to neighbours that are nearer."""
        for _ in range(MOST_STEPS):
            moved = np.zeros(len(points), bool)
            beside = self._twin[best[active]]
            for neighbour in beside.T:
                there = neighbour >= 0
                own = active[there]
                moved[self._better(own, neighbour[there] // 3, points, best, share, square)] = True
            active = np.flatnonzero(moved)
            if not len(active):
                break

    def _better(
        self, own: Index, guess: Index, points: Array, best: Index, share: Array, square: Array
    ) -> Index:
        """Take faces that are nearer; returns the points that took one."""
        new, distance = nearest_in(points[own], self.corners[guess])
        nearer = distance < square[own] * (1.0 - 1e-9)
        own = own[nearer]
        best[own], share[own], square[own] = guess[nearer], new[nearer], distance[nearer]
        return own


def _samples(corners: Array, spacing_mm: float) -> tuple[Index, Array]:
    """Points (n, 3) on the line from the middle of the shortest side of triangles, and their faces (n,)."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    rows, short = np.arange(len(corners)), np.argmin(sides, axis=1)
    middle = 0.5 * (corners[rows, short] + corners[rows, (short + 1) % 3])
    way = corners[rows, (short + 2) % 3] - middle
    count = np.maximum(np.ceil(np.linalg.norm(way, axis=1) / spacing_mm).astype(np.int64), 1)
    face, number = runs(count)
    along = (number + 0.4) / count[face]
    return face, middle[face] + along[:, None] * way[face]
