"""Neighbours on a mesh: triangles on both sides of an edge, around a vertex, and near a place."""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from relief.ground.arrays import Array, Flags, Index, extents, runs
from relief.solids.body import Body

BITS = 32
"""Bits of a vertex in the key of an edge."""
MASK = (1 << BITS) - 1
"""Bits of the second vertex in the key of an edge."""
CELL_MM = 2.5
"""Side of a cell, mm: a patch of 10 mm with the faces beside it meets a few hundred."""
MOST_ALONG = 4_000_000
"""Points on lines, about: 400 m in steps of 0.1 mm."""
MOST_CELLS = 256
"""Most cells along a side, so that a large body takes larger ones."""


def edge_ends(faces: Index) -> tuple[Index, Index]:
    """Start and end, (3 m,) each, of the half-edges of triangles (m, 3), in the order of their corners."""
    return faces.ravel(), np.roll(faces, -1, axis=1).ravel()


def edge_keys(one: Index, other: Index) -> Index:
    """Keys of edges by their ends, whichever comes first; keys rise with the lower end, then the higher."""
    return np.asarray((np.minimum(one, other).astype(np.int64) << BITS) | np.maximum(one, other))


def places_among(keys: Index, sorted_: Index) -> Index:
    """(n,) places of keys among sorted ones; -1 for keys that are none of them."""
    if not len(sorted_):
        return np.full(len(keys), -1)
    at = np.minimum(np.searchsorted(sorted_, keys), len(sorted_) - 1)
    return np.where(sorted_[at] == keys, at, -1)


def among(keys: Index, sorted_: Index) -> Flags:
    """Whether keys are among sorted ones."""
    return places_among(keys, sorted_) >= 0


def edge_balance(faces: Index) -> tuple[Index, Index, Array]:
    """Edges of triangles (m, 3) of any body.

    Returns:
        (3 m,) number of the edge of each half-edge; (edges,) numbers of triangles at each edge; and (edges,)
        numbers of half-edges that run towards the higher vertex less those that run towards the lower.
    """
    start, end = edge_ends(faces)
    keys = edge_keys(start, end)
    # Half-edges of neighbours are near one another in most files, where a stable sort is fastest.
    order = np.argsort(keys, kind="stable")
    edge = np.empty(len(keys), np.int64)
    edge[order] = np.cumsum(np.diff(keys[order], prepend=-1) != 0) - 1
    count = np.bincount(edge).astype(np.int64)
    return edge, count, np.bincount(edge, np.where(start < end, 1.0, -1.0)).astype(np.float64)


def connected(pairs: Index, count: int) -> Index:
    """(count,) numbers, from 0, of the connected components that pairs (n, 2) of items make."""
    graph = sp.coo_matrix((np.ones(len(pairs), np.int8), pairs.T), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def edge_pairs(faces: Index) -> Index:
    """Half-edges (number of the triangle times 3 plus that of the corner) on both sides of each edge, (n, 2).

    Args:
        faces: (m, 3) of a closed body.
    """
    keys = edge_keys(*edge_ends(faces))
    order = np.argsort(keys, kind="stable")
    same = keys[order[1:]] == keys[order[:-1]]
    # An edge of more than two triangles, which a sound body lacks, is left out.
    again = np.concatenate([[False], same]) & np.concatenate([same, [False]])
    first = np.flatnonzero(same & ~again[:-1] & ~again[1:])
    return np.stack([order[first], order[first + 1]], axis=1)


def twins(pairs: Index, count: int) -> Index:
    """(count,) the half-edge on the other side of each half-edge, by pairs (n, 2); -1: none."""
    twin = np.full(count, -1)
    twin[pairs[:, 0]], twin[pairs[:, 1]] = pairs[:, 1], pairs[:, 0]
    return twin


def passed_twice(faces: Index, count: int) -> Flags:
    """(count,) vertices of triangles (m, 3) at which the rim passes twice: two rim edges start there."""
    edge, around, _ = edge_balance(faces)
    return np.asarray(np.bincount(faces.ravel()[around[edge] == 1], minlength=count) > 1)


def connected_around(faces: Index, seed: int, count: int) -> Index:
    """Triangles connected with a vertex by their edges; parts that hang by a single vertex are cut off.

    Logarithmic maps need that: a vertex at which the rim passes twice has no order of its neighbours.

    Args:
        faces: (m, 3) triangles, part of a closed body.
        seed: The vertex.
        count: Number of vertices.
    """
    while True:
        part = connected(edge_pairs(faces) // 3, len(faces))
        own = part[np.flatnonzero((faces == seed).any(axis=1))[0]]
        faces = faces[part == own]
        twice = passed_twice(faces, count)
        if not twice.any():
            return faces
        stays = ~twice[faces].any(axis=1)
        stays |= (faces == seed).any(axis=1)
        if stays.all():
            return faces[(faces == seed).any(axis=1)]
        faces = faces[stays]


def ways_from(body: Body, start: Flags, most_mm: float) -> Array:
    """Distances (vertices,) along edges from some vertices, mm; infinite beyond a limit."""
    if start.all() or not start.any():
        return np.where(start, 0.0, np.inf)
    starts, ends = edge_ends(body.faces)
    length = np.linalg.norm(body.vertices[starts] - body.vertices[ends], axis=1)
    count = len(body.vertices)
    # Every edge has two triangles, which would add up its length.
    forward = starts < ends
    graph = sp.coo_matrix((length[forward], (starts[forward], ends[forward])), shape=(count, count)).tocsr()
    return np.asarray(
        dijkstra(graph, directed=False, indices=np.flatnonzero(start), min_only=True, limit=most_mm)
    )


def points_along(ends: Array, spacing_mm: float) -> Array:
    """(n, 3) points on straight lines with ends (k, 2, 3), both ends included, mm.

    They lie `spacing_mm` apart at most, or farther where these were more than `MOST_ALONG`.
    """
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    spacing_mm = max(spacing_mm, float(lengths.sum()) / MOST_ALONG)
    count = np.ceil(lengths / spacing_mm).astype(np.int64) + 1
    line, step = runs(count)
    share = (step / np.maximum(count[line] - 1, 1))[:, None]
    return np.asarray(ends[line, 0] + share * (ends[line, 1] - ends[line, 0]))


def nearest_in(points: Array, corners: Array) -> tuple[Array, Array]:
    """Barycentric coordinates (n, 3) of the nearest points of triangles (n, 3, 3), squared distances."""
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    ap = points - a
    bb, bc, cc = (ab * ab).sum(1), (ab * ac).sum(1), (ac * ac).sum(1)
    pb, pc = (ap * ab).sum(1), (ap * ac).sum(1)
    scale = bb * cc - bc * bc
    sound = scale > 1e-20 * np.maximum(bb, cc) ** 2
    scale = np.where(sound, scale, 1.0)
    v, w = (cc * pb - bc * pc) / scale, (bb * pc - bc * pb) / scale
    share = np.stack([1.0 - v - w, v, w], axis=1)
    outside = np.flatnonzero(~(sound & (share >= 0.0).all(axis=1)))
    if len(outside):
        best = np.full(len(outside), np.inf)
        for k in range(3):
            start, way = corners[outside, k], corners[outside, (k + 1) % 3] - corners[outside, k]
            length = np.maximum((way * way).sum(1), 1e-30)
            t = np.clip(((points[outside] - start) * way).sum(1) / length, 0.0, 1.0)
            square = ((start + t[:, None] * way - points[outside]) ** 2).sum(1)
            nearer = square < best
            best[nearer] = square[nearer]
            rows = outside[nearer]
            share[rows] = 0.0
            share[rows, k], share[rows, (k + 1) % 3] = 1.0 - t[nearer], t[nearer]
    nearest = np.einsum("nc,ncd->nd", share, corners)
    return share, ((nearest - points) ** 2).sum(1)


class NearFaces:
    """The faces of a body by the boxes that hold them.

    Args:
        corners: (m, 3, 3) of faces, mm.
    """

    def __init__(self, corners: Array) -> None:
        self._low, self._high = extents(corners)
        self._start = self._low.min(axis=0, initial=np.inf) if len(corners) else np.zeros(3)
        sides = self._high.max(axis=0, initial=-np.inf) - self._start if len(corners) else np.ones(3)
        self._cell = max(CELL_MM, float(sides.max()) / MOST_CELLS)
        # Faces larger than a cell, which few meshes with a texture have, are checked each time.
        small = (self._high - self._low).max(axis=1) <= self._cell
        self._large = np.flatnonzero(~small)
        numbers = np.flatnonzero(small)
        keys = self._keys(self._cells(self._low[numbers]))
        order = np.argsort(keys, kind="stable")
        self._sorted, self._of = keys[order], numbers[order]

    def _cells(self, at: Array) -> Index:
        return np.floor((at - self._start) / self._cell).astype(np.int64).clip(-1, MOST_CELLS + 1)

    @staticmethod
    def _keys(cells: Index) -> Index:
        return np.asarray(((cells[..., 0] * 1024 + cells[..., 1]) * 1024) + cells[..., 2])

    def within(self, low: Array, high: Array) -> Index:
        """Numbers of the faces, rising, whose boxes meet a box from (3,) to (3,) mm."""
        # A small face lies in the cell of its lowest corner and the next one along each axis.
        first, last = self._cells(low) - 1, self._cells(high)
        rows = np.stack(np.meshgrid(*(np.arange(first[k], last[k] + 1) for k in (0, 1)), indexing="ij"), -1)
        rows = rows.reshape(-1, 2)
        starts = self._keys(np.column_stack([rows, np.full(len(rows), first[2])]))
        begin = np.searchsorted(self._sorted, starts, side="left")
        end = np.searchsorted(self._sorted, starts + (last[2] - first[2]), side="right")
        parts = [self._of[one:other] for one, other in zip(begin, end, strict=True) if other > one]
        some = np.concatenate([self._large, *parts])
        for axis in range(3):
            some = some[(self._low[some, axis] <= high[axis]) & (self._high[some, axis] >= low[axis])]
        return np.sort(some)
