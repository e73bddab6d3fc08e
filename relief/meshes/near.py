"""Faces near a place: looked up in cells of space, as a mesh may have a million and a place needs few."""

import numpy as np

from relief.common.arrays import Array, Index

CELL_MM = 2.5
"""Side of a cell, mm: a patch of 10 mm with the faces beside it meets a few hundred."""
MOST_CELLS = 256
"""Most cells along a side, so that a large body takes larger ones."""


class NearFaces:
    """The faces of a body by the boxes that hold them.

    Args:
        corners: (m, 3, 3) of faces, mm.
    """

    def __init__(self, corners: Array) -> None:
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)
        self._start = self._low.min(axis=0, initial=np.inf) if len(corners) else np.zeros(3)
        sides = self._high.max(axis=0, initial=-np.inf) - self._start if len(corners) else np.ones(3)
        self._cell = max(CELL_MM, float(sides.max()) / MOST_CELLS)
        # Larger faces than a cell, which few meshes with a texture have, are looked at each time.
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
        some = np.sort(np.concatenate([self._large, *parts]))
        return some[((self._low[some] <= high) & (self._high[some] >= low)).all(axis=1)]
