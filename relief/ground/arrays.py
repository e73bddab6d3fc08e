"""Arrays: the types that most modules name, the smooth step, unit vectors, and blocks of rows."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""Array in double precision, the precision of everything that is measured."""
Index = NDArray[np.int64]
"""Array of numbers of things: faces, vertices, pixels, height samples."""
Flags = NDArray[np.bool_]
"""Array of truth values: which of some things are meant."""
FloatArray = NDArray[np.floating[Any]]
"""Array of floating-point numbers of any precision."""
AnyArray = NDArray[Any]
"""Array of any type."""
ROWS = 1 << 15
"""Rows of a block: a few megabytes of text."""


def smooth_step(t: ArrayLike) -> Array:
    """0 below 0, 1 above 1, and between them a cubic with flat ends."""
    t = np.clip(np.asarray(t, dtype=np.float64), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))


def units(vectors: Array) -> Array:
    """Vectors (..., 3) of length 1; 0 where they have none."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0.0)


def quantiles(values: Array, weights: AnyArray, shares: ArrayLike) -> Array:
    """(k,) the values, of (n,), up to which lie shares (k,) of the sum of their weights (n,)."""
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    places = np.searchsorted(below, np.asarray(shares) * below[-1])
    return np.asarray(values[order][np.minimum(places, len(order) - 1)])


def sums_by(index: AnyArray, values: Array, count: int) -> Array:
    """(count, k) sums of the rows of values (n, k) by their places, n numbers from 0 to count - 1."""
    places = index.ravel()
    return np.stack([np.bincount(places, column, count) for column in values.T], axis=1)


def extents(rows: AnyArray) -> tuple[AnyArray, AnyArray]:
    """Least and largest (m, ...) of the few entries along the second axis of rows (m, k, ...).

    NumPy's own reduction of an axis of two or three entries takes ten times as long.
    """
    low = high = rows[:, 0]
    for number in range(1, rows.shape[1]):
        low, high = np.minimum(low, rows[:, number]), np.maximum(high, rows[:, number])
    return low, high


def renumbered(faces: Index, count: int) -> tuple[Index, Index]:
    """Numbers (k,), rising, of the vertices that faces use, and the faces by their places among them."""
    used = flagged(faces, count)
    return np.flatnonzero(used), (np.cumsum(used) - 1)[faces]


def flagged(some: AnyArray, count: int) -> Flags:
    """(count,) which of so many things are meant, by their numbers, of any shape."""
    flags = np.zeros(count, bool)
    flags[some] = True
    return flags


def runs(counts: Index, first: Index | int = 0) -> tuple[Index, Index]:
    """Numbers of runs (k,), and the members of each, `counts` numbers from `first` on."""
    run = np.repeat(np.arange(len(counts)), counts)
    return run, np.arange(len(run)) - np.repeat(np.cumsum(counts) - counts - first, counts)


def in_blocks(rows: AnyArray, most: int | None = None) -> Iterator[AnyArray]:
    """The rows of an array in blocks of `most`, by default `ROWS`, for work that takes much more memory."""
    step = most or ROWS
    for start in range(0, len(rows), step):
        yield rows[start : start + step]
