"""Steps of remeshing on triangles with held edges: split, collapse, flip, relax (Botsch and Kobbelt 2004).

Each step is taken at many places at once, which share no vertex.
"""

import numpy as np
from numpy.typing import NDArray

from relief.body import Body
from relief.common.arrays import Array, Index
from relief.meshes.neighbourhood import BITS, MASK, among, edge_keys, edge_pairs
from relief.meshes.refining import divided

LONG, SHORT = 4.0 / 3.0, 4.0 / 5.0
"""Lengths of edges, in those wanted, from which they are split and up to which they are collapsed."""
HELD_MM = 0.005
"""Farthest that a held line may be moved by collapses along it, mm."""
MOST_AROUND = 40
"""Triangles around a vertex up to which it may be removed."""
TURN = np.cos(np.radians(40.0))
"""Cosine of the angle by which a collapse or a flip may turn a triangle."""
LONGER = 1.1
"""Factor by which a collapse may lengthen an edge that is too long already and will be split."""
THIN = 0.02
"""Twice the area of a triangle, in the square of its longest edge, below which it is a sliver."""
LEAST_GAIN = 1e-7
"""Least gain of a flip, in sines: flips between equal pairs would never end."""


class Triangles:
    """Triangles under change.

    Attributes:
        vertices: (n, 3) mm.
        faces: (m, 3).
        origin: (m,) a triangle of the first mesh in the region of each triangle, and near it.
        held: (k,) sorted keys of held edges.
        corner: (n,) vertices that stay.
        moved: (n,) how far held lines have been moved at a vertex, mm.
        size: (n,) length of edges that the surface at each vertex allows, mm.
    """

    def __init__(self, body: Body, held: NDArray[np.bool_], corner: NDArray[np.bool_], size: Array) -> None:
        self.vertices, self.faces = body.vertices.copy(), np.asarray(body.faces, np.int64).copy()
        self.origin = np.arange(len(self.faces))
        self.held = np.unique(self.keys()[held.ravel()])
        self.corner, self.moved, self.size = corner.copy(), np.zeros(len(self.vertices)), size
        self._far = self.moved
        self._refused = np.empty(0, np.int64)
        self._turned = np.ones(len(self.faces), bool)

    def keys(self) -> Index:
        """(m * 3,) keys of the edges from corner k to k + 1."""
        return edge_keys(self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel())

    @staticmethod
    def edges(faces: Index) -> Index:
        """Sorted keys of the edges of triangles (k, 3), those between two of them twice."""
        return np.sort(edge_keys(faces.ravel(), np.roll(faces, -1, axis=1).ravel()))

    def held_count(self) -> Index:
        """(n,) number of held edges at each vertex."""
        ends = np.concatenate([self.held >> BITS, self.held & MASK])
        return np.bincount(ends, minlength=len(self.vertices))

    def is_held(self, keys: Index) -> NDArray[np.bool_]:
        """Whether edges are held, by their keys."""
        return among(keys, self.held)

    def split(self, size: Array) -> int:
        """Divide the edges that are longer than wanted at their middles; returns how many.

        Args:
            size: (n,) length of edges wanted at the vertices, mm.
        """
        one, other = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        length = np.linalg.norm(self.vertices[one] - self.vertices[other], axis=1)
        # Keys of edges are the same from both sides, and so is what is long.
        chosen = np.unique(self.keys()[length > LONG * 0.5 * (size[one] + size[other])])
        if not len(chosen):
            return 0
        keys, first = self.keys(), len(self.vertices)
        at = np.minimum(np.searchsorted(chosen, keys), len(chosen) - 1)
        middles = np.where(chosen[at] == keys, first + at, -1).reshape(-1, 3)
        ends = np.stack([chosen >> BITS, chosen & MASK])
        self.vertices = np.concatenate([self.vertices, self.vertices[ends].mean(axis=0)])
        self.corner = np.concatenate([self.corner, np.zeros(len(chosen), bool)])
        self.moved = np.concatenate([self.moved, self.moved[ends].max(axis=0)])
        self.size = np.concatenate([self.size, self.size[ends].max(axis=0)])
        number = first + np.arange(len(chosen))
        parts = self.is_held(chosen)
        halves = [edge_keys(end[parts], number[parts]) for end in ends]
        self.held = np.unique(np.concatenate([self.held[~among(self.held, chosen)], *halves]))
        nothing = np.empty((len(self.faces), 3, 0))
        self.faces, parent, _ = divided(self.vertices, self.faces, middles, nothing)
        self.origin = self.origin[parent]
        return len(chosen)

    def collapse(self, size: Array) -> int:
        """Remove vertices at the ends of edges that are shorter than wanted; returns how many.

        Vertices keep their numbers until `drop_unused`.

        Args:
            size: (n,) length of edges wanted at the vertices, mm.
        """
        gone, stays = self._short_edges(size)
        ends = np.zeros(len(self.vertices), bool)
        ends[gone] = ends[stays] = True
        some = np.flatnonzero(self._count(ends) > 0)
        gone, stays = self._apart(gone, stays, self.faces[some])
        if not len(gone):
            return 0
        around = self.faces[some].ravel()
        corner_face = some[np.argsort(around, kind="stable") // 3]
        count = np.bincount(around, minlength=len(self.vertices))
        first = np.cumsum(count) - count
        number = np.repeat(np.arange(len(gone)), count[gone])
        within = np.arange(len(number)) - np.repeat(np.cumsum(count[gone]) - count[gone], count[gone])
        face = corner_face[first[gone][number] + within]
        sound = self._sound(gone, stays, size, number, face, self.edges(self.faces[some]))
        refused = (gone[~sound] << BITS) | stays[~sound]
        self._refused = np.sort(np.concatenate([self._refused, refused]))
        self._merge(gone[sound], stays[sound])
        return int(sound.sum())

    def drop_unused(self) -> None:
        """Number the vertices that are left anew."""
        used = np.zeros(len(self.vertices), bool)
        used[self.faces] = True
        renumber = np.cumsum(used) - 1
        self.faces = renumber[self.faces]
        self.vertices, self.corner = self.vertices[used], self.corner[used]
        self.moved, self.size = self.moved[used], self.size[used]
        self.held = np.unique(edge_keys(renumber[self.held >> BITS], renumber[self.held & MASK]))
        self._refused = np.empty(0, np.int64)

    def _short_edges(self, size: Array) -> tuple[Index, Index]:
        """Vertices that may be removed, and those they are moved to, the shortest edges first."""
        one, other = self.faces.ravel(), np.roll(self.faces, -1, axis=1).ravel()
        once = one < other
        one, other = one[once], other[once]
        length = np.linalg.norm(self.vertices[one] - self.vertices[other], axis=1)
        length /= 0.5 * (size[one] + size[other])
        short = np.flatnonzero(length < SHORT)
        keys = (one[short] << BITS) | other[short]
        order = np.argsort(keys)
        keys, length = keys[order], length[short][order]
        one, other = keys >> BITS, keys & MASK
        lines, around = self.held_count(), np.bincount(self.faces.ravel(), minlength=len(self.vertices))
        held = self.is_held(keys)
        free = ~self.corner & (around <= MOST_AROUND)
        ways = []
        for gone, stays in ((one, other), (other, one)):
            may = free[gone] & ((lines[gone] == 0) | (held & (lines[gone] == 2)))
            may &= ~among((gone << BITS) | stays, self._refused)
            ways.append(np.stack([gone[may], stays[may], np.flatnonzero(may)]))
        gone, stays, edge = np.concatenate(ways, axis=1)
        order = np.argsort(length[edge], kind="stable")
        return gone[order], stays[order]

    def _apart(self, gone: Index, stays: Index, faces: Index) -> tuple[Index, Index]:
        """Those of the vertices to be removed, the first at each, that have no neighbour in common.

        Args:
            gone: (k,) vertices to be removed.
            stays: (k,) those they are moved to.
            faces: (m, 3) all triangles around them.
        """
        gone, first = np.unique(gone, return_index=True)
        stays = stays[first]
        # Vertices in any order: with that of their lengths few would be first among their neighbours.
        rank = np.random.default_rng(len(gone)).permutation(len(gone))
        best = np.full(len(self.vertices), len(gone))
        best[gone] = rank
        one, other = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
        for _ in range(2):
            around = best.copy()
            np.minimum.at(around, one, best[other])
            np.minimum.at(around, other, best[one])
            best = around
        chosen = best[gone] == rank
        return gone[chosen], stays[chosen]

    def _sound(
        self, gone: Index, stays: Index, size: Array, number: Index, face: Index, edges: Index
    ) -> NDArray[np.bool_]:
        """(k,) whether removals keep the surface whole, its triangles upright, and held lines in place."""
        corners = self.faces[face]
        around = corners.ravel()
        rank = np.repeat(number, 3)
        beside = (around != gone[rank]) & (around != stays[rank])
        joined = among(edge_keys(around[beside], stays[rank[beside]]), edges)
        sound = np.bincount(rank[beside][joined], minlength=len(gone)) == 4
        moved = ~(corners == stays[number][:, None]).any(axis=1)
        number, corners = number[moved], corners[moved]
        old = self.vertices[corners]
        new = np.where(
            (corners == gone[number][:, None])[:, :, None], self.vertices[stays[number]][:, None], old
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

    def _in_line(self, gone: Index, stays: Index) -> NDArray[np.bool_]:
        """(k,) whether removals leave held lines where they are."""
        lines = self.held_count()
        held = np.flatnonzero(lines[gone] > 0)
        sound = np.ones(len(gone), bool)
        self._far = np.zeros(len(self.vertices))
        if not len(held):
            return sound
        one, other = self.held >> BITS, self.held & MASK
        total = np.zeros(len(self.vertices), np.int64)
        np.add.at(total, one, other)
        np.add.at(total, other, one)
        vertex, near = gone[held], stays[held]
        beyond = self.vertices[total[vertex] - near]
        start, point = self.vertices[near], self.vertices[vertex]
        way = beyond - start
        t = ((point - start) * way).sum(1) / np.maximum((way * way).sum(1), 1e-30)
        far = np.linalg.norm(start + np.clip(t, 0.0, 1.0)[:, None] * way - point, axis=1)
        sound[held] = far + self.moved[vertex] <= HELD_MM
        self._far[vertex] = far
        return sound

    def _merge(self, gone: Index, stays: Index) -> None:
        """Move vertices to others, and leave out what has no area then."""
        target = np.arange(len(self.vertices))
        target[gone] = stays
        lines = self.held_count()[gone] > 0
        for vertex in (gone[lines], stays[lines]):
            far = self.moved[gone[lines]] + self._far[gone[lines]]
            self.moved[vertex] = np.maximum(self.moved[vertex], far)
        one, other = target[self.held >> BITS], target[self.held & MASK]
        faces = target[self.faces]
        kept = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
        self.faces, self.origin = faces[kept], self.origin[kept]
        apart = one != other
        self.held = np.unique(edge_keys(one[apart], other[apart]))

    def flip(self, again: bool) -> int:
        """Flip edges towards Delaunay's triangles where the surface turns little; returns how many.

        Args:
            again: Whether only flips have followed the last call: then only edges are looked at whose
                triangles were flipped, or could not be, as others were beside them.
        """
        pairs, edges = self._flippable(again)
        one, other = pairs[:, 0] // 3, pairs[:, 1] // 3
        a, b = self.faces.ravel()[pairs[:, 0]], self.faces[one, (pairs[:, 0] + 1) % 3]
        c, d = self.faces[one, (pairs[:, 0] + 2) % 3], self.faces[other, (pairs[:, 1] + 2) % 3]
        gain = _beyond_delaunay(self.vertices, a, b, c, d)
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
        sound &= ~among(new, edges) & (c != d)
        order = np.flatnonzero(sound)
        self._turned = np.zeros(len(self.faces), bool)
        self._turned[one[order]] = self._turned[other[order]] = True
        order = order[np.argsort(-gain[order], kind="stable")]
        # One flip for the four triangles' vertices each, so that no two make one edge.
        best = np.full(len(self.faces), len(order))
        rank = np.arange(len(order))
        for face in (one[order], other[order]):
            np.minimum.at(best, face, rank)
        order = order[(best[one[order]] == rank) & (best[other[order]] == rank)]
        order = order[np.sort(np.unique(new[order], return_index=True)[1])]
        self.faces[one[order]] = np.stack([a, d, c], axis=1)[order]
        self.faces[other[order]] = np.stack([d, b, c], axis=1)[order]
        return len(order)

    def _flippable(self, again: bool) -> tuple[Index, Index]:
        """Half-edges (k, 2) on both sides of edges that may be flipped, and keys of all edges near them."""
        some, turned = np.arange(len(self.faces)), np.ones(len(self.faces), bool)
        if again:
            turned = self._turned
            for least in (2, 1):
                ends = np.zeros(len(self.vertices), bool)
                ends[self.faces[turned if least == 2 else some]] = True
                some = np.flatnonzero(self._count(ends) >= least)
        faces = self.faces[some]
        pairs = edge_pairs(faces, len(self.vertices))
        keys = edge_keys(faces.ravel(), np.roll(faces, -1, axis=1).ravel())
        kept = ~self.is_held(keys[pairs[:, 0]])
        pairs = 3 * some[pairs[kept] // 3] + pairs[kept] % 3
        return pairs[turned[pairs[:, 0] // 3] | turned[pairs[:, 1] // 3]], np.sort(keys)

    def _count(self, chosen: NDArray[np.bool_]) -> NDArray[np.int8]:
        """(m,) number of corners of each triangle among chosen vertices."""
        one, two, three = (chosen[self.faces[:, k]].view(np.int8) for k in range(3))
        return np.asarray(one + two + three)

    def _unit(self, a: Index, b: Index, c: Index) -> Array:
        """Unit normals (n, 3) of triangles by their corners; 0 where they have no area."""
        normal = np.cross(self.vertices[b] - self.vertices[a], self.vertices[c] - self.vertices[a])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        return np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)


def _beyond_delaunay(vertices: Array, a: Index, b: Index, c: Index, d: Index) -> Array:
    """Negative sine of the sum of the angles at c and d, opposite to an edge a-b; above 0: not Delaunay's."""

    def angle(at: Index) -> tuple[Array, Array]:
        one, two = vertices[a] - vertices[at], vertices[b] - vertices[at]
        scale = np.linalg.norm(one, axis=1) * np.linalg.norm(two, axis=1)
        scale = np.where(scale > 0.0, scale, 1.0)
        return (one * two).sum(axis=1) / scale, np.linalg.norm(np.cross(one, two), axis=1) / scale

    (cos_c, sin_c), (cos_d, sin_d) = angle(c), angle(d)
    return np.asarray(-(sin_c * cos_d + cos_c * sin_d))
