"""Collapses of short edges: vertices are removed, many at once, which share no neighbour."""

import numpy as np

from relief.ground.arrays import Array, Flags, Index, flagged
from relief.solids.meshes.neighbourhood import BITS, MASK, among, edge_ends, edge_keys
from relief.solids.remeshing.triangles import LONG, Triangles

SHORT = 4.0 / 5.0
"""Length of an edge, relative to the wanted length, below which the edge is collapsed."""
HELD_MM = 0.005
"""Largest displacement of a held line by collapses, mm."""
MOST_AROUND = 40
"""Triangles around a vertex up to which it may be removed."""
TURN = np.cos(np.radians(40.0))
"""Cosine of the angle by which a collapse may turn a triangle."""
LONGER = 1.1
"""Factor by which a collapse may lengthen an edge that is too long already and will be split."""
THIN = 0.02
"""Twice the area of a triangle, in the square of its longest edge, below which it is a sliver."""


class Collapses:
    """Passes of collapses over triangles; vertices keep their numbers between passes.

    Attributes:
        triangles: Changed in place.
    """

    def __init__(self, triangles: Triangles) -> None:
        self.triangles = triangles
        self._far = triangles.moved
        self._refused = np.empty(0, np.int64)

    def collapse(self, size: Array) -> int:
        """Remove vertices at the ends of edges that are shorter than wanted; returns how many.

        Vertices keep their numbers until `drop_unused`.

        Args:
            size: (n,) length of edges wanted at the vertices, mm.
        """
        gone, stays = self._short_edges(size)
        gone, stays = self._apart(gone, stays, self.triangles.faces[self._around(gone, stays)])
        if not len(gone):
            return 0
        some = self._around(gone, stays)
        rank = np.full(len(self.triangles.vertices), -1)
        rank[gone] = np.arange(len(gone))
        around = rank[self.triangles.faces[some].ravel()]
        corner = np.flatnonzero(around >= 0)
        corner = corner[np.argsort(around[corner], kind="stable")]
        number, face = around[corner], some[corner // 3]
        edges = np.sort(edge_keys(*edge_ends(self.triangles.faces[some])))
        sound = self._sound(gone, stays, size, number, face, edges)
        refused = (gone[~sound] << BITS) | stays[~sound]
        self._refused = np.sort(np.concatenate([self._refused, refused]))
        self._merge(gone[sound], stays[sound])
        return int(sound.sum())

    def _around(self, gone: Index, stays: Index) -> Index:
        """Numbers of the triangles, rising, around vertices to be removed and those they go to."""
        ends = flagged(np.concatenate([gone, stays]), len(self.triangles.vertices))
        return np.flatnonzero(self.triangles.count(ends) > 0)

    def _short_edges(self, size: Array) -> tuple[Index, Index]:
        """Vertices that may be removed, each once and rising, and those at their shortest edges."""
        triangles, count = self.triangles, len(self.triangles.vertices)
        one, other = edge_ends(triangles.faces)
        once = one < other
        one, other = one[once], other[once]
        length = triangles.lengths(one, other)
        length /= 0.5 * (size[one] + size[other])
        short = np.flatnonzero(length < SHORT)
        one, other, length = one[short], other[short], length[short]
        lines, around = triangles.held_count(), np.bincount(triangles.faces.ravel(), minlength=count)
        held = among((one << BITS) | other, triangles.held)
        free = ~triangles.corner & (around <= MOST_AROUND)
        ways = []
        for gone, stays in ((one, other), (other, one)):
            may = free[gone] & ((lines[gone] == 0) | (held & (lines[gone] == 2)))
            may &= ~among((gone << BITS) | stays, self._refused)
            ways.append((gone[may], stays[may], length[may]))
        gone, stays, length = (np.concatenate(part) for part in zip(*ways, strict=True))
        shortest = np.full(count, np.inf)
        np.minimum.at(shortest, gone, length)
        least = length == shortest[gone]
        # Ties go to the next higher number of a vertex, so that the order of edges has no effect.
        beyond = np.full(count, count)
        np.minimum.at(beyond, gone[least], (stays[least] - gone[least]) % count)
        gone = np.flatnonzero(beyond < count)
        return gone, (gone + beyond[gone]) % count

    def _apart(self, gone: Index, stays: Index, faces: Index) -> tuple[Index, Index]:
        """Those of the vertices to be removed, each once and rising, that have no neighbour in common.

        Args:
            gone: (k,) vertices to be removed.
            stays: (k,) those they are moved to.
            faces: (m, 3) all triangles around them.
        """
        # A random order: in the order of lengths few vertices would be first among their neighbours.
        rank = np.random.default_rng(len(gone)).permutation(len(gone))
        best = np.full(len(self.triangles.vertices), len(gone))
        best[gone] = rank
        one, other = edge_ends(faces)
        for _ in range(2):
            around = best.copy()
            np.minimum.at(around, one, best[other])
            np.minimum.at(around, other, best[one])
            best = around
        chosen = best[gone] == rank
        return gone[chosen], stays[chosen]

    def _sound(
        self, gone: Index, stays: Index, size: Array, number: Index, face: Index, edges: Index
    ) -> Flags:
        """(k,) whether removals keep the surface whole, its triangles upright, and held lines in place."""
        corners = self.triangles.faces[face]
        around = corners.ravel()
        rank = np.repeat(number, 3)
        beside = (around != gone[rank]) & (around != stays[rank])
        keys = edge_keys(around[beside], stays[rank[beside]])
        joined = among(keys, edges)
        sound = np.bincount(rank[beside][joined], minlength=len(gone)) == 4
        sound[rank[beside][~joined & among(keys, self.triangles.taken)]] = False
        moved = ~(corners == stays[number][:, None]).any(axis=1)
        number, corners = number[moved], corners[moved]
        old = self.triangles.vertices[corners]
        new = np.where(
            (corners == gone[number][:, None])[:, :, None],
            self.triangles.vertices[stays[number]][:, None],
            old,
        )
        before, after = (np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]) for t in (old, new))
        areas = [np.linalg.norm(normal, axis=1) for normal in (before, after)]
        longest = [((np.roll(t, -1, axis=1) - t) ** 2).sum(axis=2).max(axis=1) for t in (old, new)]
        thin = [area / np.maximum(length, 1e-30) for area, length in zip(areas, longest, strict=True)]
        upright = np.where(thin[0] < THIN, 0.0, TURN)
        bad = (before * after).sum(axis=1) < upright * areas[0] * areas[1]
        bad |= (thin[1] < THIN) & (thin[1] < thin[0])
        bad |= longest[1] > np.maximum((LONG * size[gone[number]]) ** 2, LONGER**2 * longest[0])
        sound[number[bad]] = False
        return sound & self._in_line(gone, stays)

    def _in_line(self, gone: Index, stays: Index) -> Flags:
        """(k,) whether removals leave held lines where they are."""
        lines = self.triangles.held_count()
        held = np.flatnonzero(lines[gone] > 0)
        sound = np.ones(len(gone), bool)
        self._far = np.zeros(len(self.triangles.vertices))
        if not len(held):
            return sound
        one, other = self.triangles.held >> BITS, self.triangles.held & MASK
        total = np.zeros(len(self.triangles.vertices), np.int64)
        np.add.at(total, one, other)
        np.add.at(total, other, one)
        vertex, near = gone[held], stays[held]
        beyond = self.triangles.vertices[total[vertex] - near]
        start, point = self.triangles.vertices[near], self.triangles.vertices[vertex]
        way = beyond - start
        t = ((point - start) * way).sum(1) / np.maximum((way * way).sum(1), 1e-30)
        far = np.linalg.norm(start + np.clip(t, 0.0, 1.0)[:, None] * way - point, axis=1)
        sound[held] = far + self.triangles.moved[vertex] <= HELD_MM
        self._far[vertex] = far
        return sound

    def _merge(self, gone: Index, stays: Index) -> None:
        """Move vertices to others, and leave out what has no area then."""
        target = np.arange(len(self.triangles.vertices))
        target[gone] = stays
        lines = self.triangles.held_count()[gone] > 0
        for vertex in (gone[lines], stays[lines]):
            far = self.triangles.moved[gone[lines]] + self._far[gone[lines]]
            self.triangles.moved[vertex] = np.maximum(self.triangles.moved[vertex], far)
        one, other = target[self.triangles.held >> BITS], target[self.triangles.held & MASK]
        faces = target[self.triangles.faces]
        kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        self.triangles.faces, self.triangles.origin = faces[kept], self.triangles.origin[kept]
        apart = one != other
        self.triangles.held = np.unique(edge_keys(one[apart], other[apart]))
