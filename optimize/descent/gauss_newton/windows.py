"""Solutions of the equations of a step window by window, for surfaces too large for one factorisation.

The surface is divided into cores; each core with a margin around it is a window. A window's equations are
factorised and solved with the heights outside held still, and of its solution the core is kept (restricted
additive Schwarz, Cai and Sarkis 1999). A touch belongs to the window whose core holds its middle, and the
response to a force on it is that window's whole solution. Time and memory grow with the number of windows,
thus linearly with area. The solutions are approximate: what a change of heights does farther away than the
margin is left out of a step, and the next step makes up for it. The slopes of the targets along these
solutions are exact, so that a step still meets the targets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from relief.common.arrays import Array, Index
from relief.common.progress import stage
from relief.patches import Patches
from tactile.sparse import factorised

MOST_AT_ONCE = 512 * 512
"""Most samples of a surface whose equations are factorised at once; 3.3 GB and some ten seconds a step."""
CORE = 256
"""Largest side of a core, samples."""
MARGIN = 32
"""Samples from a patch to the side of its window, at least. On gravel of 384 x 384 samples, the least squares
that a step minimises are then 0.01 % above those of one factorisation (0.7 % at the least damping); without
this margin, 0.4 % (1.2 %)."""


@dataclass(frozen=True)
class Window:
    """A window of a surface.

    Attributes:
        samples: (m,) flat indices of the window's samples on the surface, rising rows first.
        core: (m,) bool, whether a sample lies in the core; every sample of the surface is in one core.
    """

    samples: Index
    core: NDArray[np.bool_]


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
    matrix: sp.csr_matrix, load: Array, gradients: sp.csr_matrix, patches: Patches, core: int = CORE
) -> tuple[Array, sp.csc_matrix]:
    """Solve `matrix x = load`, and `matrix y = gradient` for each target at each place, window by window.

    Args:
        matrix: (samples, samples), symmetric positive definite; couples near samples.
        load: (samples,).
        gradients: (targets * places, samples), target by target; each row is zero beyond its patch.
        patches: of the surface, one at each place.
        core: largest side of a core, samples.

    Returns:
        x (samples,) and the y as columns (samples, targets * places).
    """
    shape = patches.surface.shape
    middles = (patches.places + np.array(patches.shape) // 2) % shape
    # Of the places of each target.
    middle = np.tile(middles[:, 0] * shape[1] + middles[:, 1], gradients.shape[0] // patches.count)
    margin = max(patches.shape) // 2 + MARGIN
    unconstrained, columns, order = np.zeros(matrix.shape[0]), list[sp.csc_matrix](), list[Index]()
    each = list(windows(shape, patches.surface.repeats, core, margin))
    with stage("solving for a step, window by window", len(each)) as advance:
        for window in each:
            own = np.flatnonzero(np.isin(middle, window.samples[window.core]))
            solve = factorised(matrix[window.samples][:, window.samples], minimum_degree=True)
            forced = gradients[own][:, window.samples].toarray()
            solved = solve(np.column_stack((load[window.samples], forced.T)))
            unconstrained[window.samples[window.core]] = solved[window.core, 0]
            order.append(own)
            columns.append(_placed(solved[:, 1:], window.samples, matrix.shape[0]))
            advance()
    responses = sp.hstack(columns, format="csc")
    return unconstrained, responses[:, np.argsort(np.concatenate(order))]


def _placed(values: Array, samples: Index, total: int) -> sp.csc_matrix:
    """Columns (m, n) over the samples of a window as sparse columns over all `total` samples."""
    rising = np.argsort(samples)
    # Single precision halves the memory: directions of a step need no more digits, their slopes are exact.
    data = values[rising].T.ravel().astype(np.float32)
    starts = np.arange(values.shape[1] + 1) * len(samples)
    return sp.csc_matrix((data, np.tile(samples[rising], values.shape[1]), starts), (total, values.shape[1]))
