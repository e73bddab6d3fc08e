"""Heights of triangles on a grid: at each sample the highest, which a finger from above meets."""

import numpy as np

from relief.arrays import Array, Index

SAMPLES_AT_ONCE = 1 << 20
"""Pairs of a triangle and a sample of its box that are looked at together, which bounds the memory."""
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
    low = np.clip(np.ceil(at.min(axis=1)), 0, samples).astype(np.int64)
    high = np.clip(np.floor(at.max(axis=1)), -1, samples - 1).astype(np.int64)
    sides = np.maximum(high - low + 1, 0)
    counts = sides.prod(axis=1)
    some = np.flatnonzero(counts)
    ends = np.cumsum(counts[some])
    slopes = slopes * (1.0 / scale, -1.0 / scale)
    start = 0
    while start < len(some):
        before = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, before + SAMPLES_AT_ONCE, side="right")))
        part = some[start:stop]
        face = np.repeat(part, counts[part])
        number = np.arange(len(face)) - np.repeat(np.cumsum(counts[part]) - counts[part], counts[part])
        cols, rows = low[face, 0] + number % sides[face, 0], low[face, 1] + number // sides[face, 0]
        x, y = np.moveaxis(at[face], 2, 0) - np.stack([cols, rows])[:, :, None]
        shares, inside = _shares(x, y)
        face, sample = face[inside], (rows * samples + cols)[inside]
        np.maximum.at(heights, sample, _cubic(shares[inside], at[face], corners[face, :, 2], slopes[face]))
        start = stop
    return heights.reshape(samples, samples)


def _shares(x: Array, y: Array) -> tuple[Array, Index]:
    """Barycentric coordinates (k, 3) of the origin in triangles, and the numbers of those that hold it."""
    following, last = np.array([1, 2, 0]), np.array([2, 0, 1])
    shares = x[:, following] * y[:, last] - x[:, last] * y[:, following]
    area = shares.sum(axis=1)
    shares /= np.where(area == 0.0, np.inf, area)[:, None]
    return shares, np.flatnonzero((shares.min(axis=1) >= INSIDE) & (area != 0.0))


def _cubic(shares: Array, at: Array, heights: Array, slopes: Array) -> Array:
    """(k,) heights of Bézier triangles (k, 3, 2), with heights (k, 3) and slopes (k, 3, 2) at the corners.

    The control point in the middle is that of Farin: by it a surface of second order comes out exactly.
    """
    edges = np.zeros(len(shares))
    value = (shares**3 * heights).sum(axis=1)
    for one in range(3):
        for other in ((one + 1) % 3, (one + 2) % 3):
            rise = (slopes[:, one] * (at[:, other] - at[:, one])).sum(axis=1)
            control = heights[:, one] + rise / 3.0
            value += 3.0 * shares[:, one] ** 2 * shares[:, other] * control
            edges += control
    middle = edges / 4.0 - heights.sum(axis=1) / 6.0
    return np.asarray(value + 6.0 * shares.prod(axis=1) * middle)
