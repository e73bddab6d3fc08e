"""Solutions of the equations of a step window by window, for surfaces too large for one factorisation.

The surface is divided into cores; each core with a margin around it is a window. A window's equations are
factorised and solved with the heights outside held still, and of its solution the core is kept (restricted
additive Schwarz, Cai and Sarkis 1999). A touch belongs to the window whose core holds its middle, and the
response to a force on it is that window's whole solution. Time and memory grow with the number of windows,
thus linearly with area. The solutions are approximate: effects of a change of heights farther away than the
margin are left out of a step, and the next step corrects them. The slopes of the targets along these
solutions are exact, so that a step still meets the targets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from optimize.descent.gauss_newton.broad import with_rows
from relief.ground.arrays import Array, Index
from relief.ground.progress import stage
from relief.patches import Patches
from tactile.sparse import Solve, factorised

MOST_AT_ONCE = 512 * 512
"""Most samples of a surface whose equations are factorised at once; 3.3 GB and some ten seconds a step."""
CORE = 256
"""Largest side of a core, samples."""
MARGIN = 32
"""Samples from a patch to the side of its window, at least. On gravel of 384 x 384 samples, the least squares
that a step minimises are then 0.01 % above those of one factorisation (0.7 % at the least damping); without
this margin, 0.4 % (1.2 %)."""


ROWS_AT_ONCE = 64
"""Rows that are made dense together for a product: 64 MB on a window of 512 x 512 samples."""


@dataclass(frozen=True)
class Window:
    """A window of a surface.

    Attributes:
        samples: (m,) flat indices of the window's samples on the surface, rising rows first.
        core: (m,) bool, whether a sample lies in the core; every sample of the surface is in one core.
    """

    samples: Index
    core: NDArray[np.bool_]


class _Columns(NamedTuple):
    """Columns over the samples of one window.

    Attributes:
        samples: (m,) flat indices of the window's samples on the surface.
        columns: (k,) their numbers.
        values: (k, m), column by column.
    """

    samples: Index
    columns: Index
    values: NDArray[np.float32]


class WindowColumns(NamedTuple):
    """Matrix (samples, columns), each of whose columns is zero beyond one window and dense on it.

    Attributes:
        shape: of the matrix.
        parts: window by window; each column is in one.
    """

    shape: tuple[int, int]
    parts: tuple[_Columns, ...]

    def __matmul__(self, factors: Array) -> Array:
        """(samples,) sum of the columns by factors (columns,)."""
        total = np.zeros(self.shape[0])
        for samples, columns, values in self.parts:
            total[samples] += factors[columns].astype(np.float32) @ values
        return total

    def under(self, rows: sp.csr_matrix) -> Array:
        """(k, columns) product of sparse rows (k, samples) and this matrix."""
        product = np.zeros((rows.shape[0], self.shape[1]))
        for samples, columns, values in self.parts:
            inside = np.zeros(self.shape[0], dtype=bool)
            inside[samples] = True
            counts = np.concatenate(([0], np.cumsum(inside[rows.indices])))
            # Most rows of a large surface end before the window begins.
            near = np.flatnonzero(np.diff(counts[rows.indptr]))
            for some in np.array_split(near, -(-len(near) // ROWS_AT_ONCE) or 1):
                dense = rows[some][:, samples].astype(np.float32).toarray()
                product[np.ix_(some, columns)] = dense @ values.T
        return product


def in_one(rows: NDArray[np.float32]) -> WindowColumns:
    """The columns (k, samples) of a surface that is one window."""
    return WindowColumns(rows.shape[::-1], (_Columns(np.arange(rows.shape[1]), np.arange(len(rows)), rows),))


def solved_sides(solve: Solve, *sides: Array | sp.csr_matrix) -> NDArray[np.float32]:
    """(k, n) solutions for right-hand sides, each (n,) or some (m, n), as rows in single precision.

    Directions of a step need no more digits, and rows of single precision go to Pardiso and back uncopied.
    """
    ends = np.cumsum([0, *(1 if side.ndim == 1 else side.shape[0] for side in sides)])
    rows = np.empty((ends[-1], sides[0].shape[-1]), np.float32)
    for (start, end), side in zip(pairwise(ends), sides, strict=True):
        if isinstance(side, np.ndarray):
            rows[start:end] = side
        else:
            side.astype(np.float32).toarray(out=rows[start:end])
    return np.ascontiguousarray(solve(rows.T).T, np.float32)


def windows(shape: tuple[int, int], repeats: tuple[bool, bool], core: int, margin: int) -> Iterator[Window]:
    """The windows of a surface of `shape` (rows, cols), whose margins wrap along axes that repeat.

    Args:
        shape: of the surface.
        repeats: whether it repeats along rows and along columns.
        core: largest side of a core, samples.
        margin: on each side of a core, samples.
    """
    down, across = (_spans(*axis, core, margin) for axis in zip(shape, repeats, strict=True))
    for rows, own_rows in down:
        for cols, own_cols in across:
            yield Window((rows[:, None] * shape[1] + cols).ravel(), np.outer(own_rows, own_cols).ravel())


def _spans(length: int, repeats: bool, core: int, margin: int) -> list[tuple[Index, NDArray[np.bool_]]]:
    """Samples of each window along one axis, and which of them are of its core."""
    ends = np.linspace(0, length, -(-length // core) + 1).round().astype(int)
    spans = []
    for first, last in pairwise(ends):
        low, high = first - margin, last + margin
        if high - low >= length:
            samples = np.arange(length)
        elif repeats:
            samples = np.arange(low, high) % length
        else:
            samples = np.arange(max(low, 0), min(high, length))
        spans.append((samples, (first <= samples) & (samples < last)))
    return spans


def windowed_response(
    matrix: sp.csr_matrix,
    load: Array,
    gradients: sp.csr_matrix,
    patches: Patches,
    low_rank: sp.csr_matrix | None = None,
    core: int = CORE,
) -> tuple[Array, WindowColumns]:
    """Solve `matrix x = load`, and `matrix y = gradient` for each target at each place, window by window.

    Args:
        matrix: (samples, samples), symmetric positive definite; couples near samples.
        load: (samples,).
        gradients: (targets * places, samples), target by target; each row is zero beyond its patch.
        patches: of the surface, one at each place.
        low_rank: (k, samples), whose product with itself is added to the matrix.
        core: largest side of a core, samples.

    Returns:
        x (samples,) and the y as columns (samples, targets * places).
    """
    shape = patches.surface.shape
    middles = (patches.places + np.array(patches.shape) // 2) % shape
    # Of the places of each target.
    middle = np.tile(middles[:, 0] * shape[1] + middles[:, 1], gradients.shape[0] // patches.count)
    margin = max(patches.shape) // 2 + MARGIN
    unconstrained, parts = np.zeros(matrix.shape[0]), list[_Columns]()
    each = list(windows(shape, patches.surface.repeats, core, margin))
    with stage("solving for a step, window by window", len(each)) as advance:
        for window in each:
            own = np.flatnonzero(np.isin(middle, window.samples[window.core]))
            rows = None if low_rank is None else low_rank[:, window.samples]
            solve = with_rows(factorised(matrix[window.samples][:, window.samples], single=True), rows)
            solved = solved_sides(solve, load[window.samples], gradients[own][:, window.samples])
            unconstrained[window.samples[window.core]] = solved[0, window.core]
            parts.append(_Columns(window.samples, own, solved[1:]))
            advance()
    return unconstrained, WindowColumns((matrix.shape[0], gradients.shape[0]), tuple(parts))
