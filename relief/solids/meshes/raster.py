"""Heights of triangles on a grid: at each sample the highest, which a finger from above touches."""

from collections.abc import Iterator

import numpy as np

from relief.ground.arrays import Array, Index, extents, runs

SAMPLES_AT_ONCE = 1 << 18
"""Pairs of a triangle and a sample of its box that are computed together, which bounds the memory."""
INSIDE = -1e-9
"""Least barycentric coordinate of a sample that counts as in a triangle, so that none falls between two."""


def rasterise(corners: Array, slopes: Array, size_mm: float, samples: int) -> Array:
    """Sample the upper side of triangles.

    Args:
        corners: (m, 3, 3) mm; the grid lies around the origin of the first two axes, heights are the third.
        slopes: (m, 3, 2) derivatives of the height by the first two axes at the corners. Between them a
            triangle is the cubic of Bézier with these slopes; a flat triangle has the slopes of its plane.
        size_mm: side of the square grid, mm.
        samples: along a side.

    Returns:
        (samples, samples) mm, row 0 at +y, column 0 at -x; -inf where no triangle lies.
    """
    heights = np.full(samples * samples, -np.inf)
    scale = samples / size_mm
    # In columns and rows of the grid, counted from the centre of the first sample.
    at = corners[:, :, :2] * (scale, -scale) + (0.5 * samples - 0.5)
    covered = Covered(at, samples, samples)
    some = covered.faces
    # Heights are ten products of barycentric coordinates, whose factors are computed once.
    controls = _controls(at[some], corners[some, :, 2], slopes[some] * (1.0 / scale, -1.0 / scale))
    for face, sample, shares in covered:
        np.maximum.at(heights, sample, _cubic(shares, controls[:, face]))
    return heights.reshape(samples, samples)


class Covered:
    """The samples of a grid that lie in triangles.

    Attributes:
        faces: numbers of the triangles whose boxes hold samples.
    """

    def __init__(self, at: Array, rows: int, cols: int) -> None:
        """Look for boxes that hold samples.

        Args:
            at: (m, 3, 2) corners, in columns and rows counted from the first sample.
            rows: of the grid.
            cols: of the grid.
        """
        low, high = extents(at)
        low = np.clip(np.ceil(low), 0, (cols, rows)).astype(np.int64)
        high = np.clip(np.floor(high), -1, (cols - 1, rows - 1)).astype(np.int64)
        sides = np.maximum(high - low + 1, 0)
        edges = np.roll(at, -2, axis=1) - np.roll(at, -1, axis=1)
        area = edges[:, 1, 0] * edges[:, 2, 1] - edges[:, 1, 1] * edges[:, 2, 0]
        self.faces = some = np.flatnonzero((sides.prod(axis=1) > 0) & (area != 0.0))
        self._cols, self._low, self._sides = cols, low[some], sides[some]
        # Terms that all samples of a triangle share are computed once: barycentric coordinates are linear
        # in columns and rows.
        by = np.stack([-edges[some, :, 1], edges[some, :, 0]]).transpose(0, 2, 1) / area[some]
        nearest = np.roll(at[some], -1, axis=1) - low[some, None]
        self._by_col, self._by_row = by
        self._first = -(self._by_col * nearest[..., 0].T + self._by_row * nearest[..., 1].T)

    def __iter__(self) -> Iterator[tuple[Index, Index, list[Array]]]:
        """Places of triangles in `faces` (k,), numbers of samples (k,), row by row, and 3 shares (k,)."""
        sides, low = self._sides, self._low
        ends = np.cumsum(sides.prod(axis=1))
        start = 0
        while start < len(sides):
            before = ends[start - 1] if start else 0
            stop = max(start + 1, int(np.searchsorted(ends, before + SAMPLES_AT_ONCE, side="right")))
            counts = np.diff(ends[start:stop], prepend=before)
            face, within = runs(counts)
            face += start
            row, col = np.divmod(within, sides[face, 0])
            shares = [
                self._first[n][face] + self._by_col[n][face] * col + self._by_row[n][face] * row
                for n in range(3)
            ]
            inside = np.flatnonzero(np.minimum(np.minimum(*shares[:2]), shares[2]) >= INSIDE)
            face = face[inside]
            sample = (low[face, 1] + row[inside]) * self._cols + low[face, 0] + col[inside]
            yield face, sample, [share[inside] for share in shares]
            start = stop


PAIRS = ((0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1))
"""Corners of the six control points on the edges of a Bézier triangle: the one they lie at, and the other."""


def _controls(at: Array, heights: Array, slopes: Array) -> Array:
    """Control points (10, k) of Bézier triangles: 3 corners, 6 on the edges, 1 in the middle.

    That in the middle is that of Farin: by it a surface of second order comes out exactly.

    Args:
        at: (k, 3, 2) corners.
        heights: (k, 3) at the corners.
        slopes: (k, 3, 2) at the corners.
    """
    edges = [
        heights[:, one] + (slopes[:, one] * (at[:, other] - at[:, one])).sum(axis=1) / 3.0
        for one, other in PAIRS
    ]
    middle = sum(edges) / 4.0 - heights.sum(axis=1) / 6.0
    return np.stack([*heights.T, *edges, middle])


def _cubic(shares: list[Array], controls: Array) -> Array:
    """(k,) heights at barycentric coordinates, three of (k,), by control points (10, k)."""
    value = 6.0 * shares[0] * shares[1] * shares[2] * controls[9]
    for corner, share in enumerate(shares):
        edges = sum(
            shares[other] * controls[3 + number] for number, (one, other) in enumerate(PAIRS) if one == corner
        )
        value += share**2 * (share * controls[corner] + 3.0 * edges)
    return np.asarray(value)
