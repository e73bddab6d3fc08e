"""Corrections of measured heights: samples that were not measured are filled, a tilt is taken out."""

from typing import Any

import numpy as np

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError

FEWEST_SAMPLES = 500
"""Samples of the coarsest grid, whose equations are solved directly."""
AGGREGATE = 3
"""Samples along a side of the square that becomes one sample of the next coarser grid."""
DAMPING = 2.0 / 3.0
"""Weight of a Jacobi step, which halves the roughest errors of Laplace's equation and prolongs smoothly."""
ACCURACY = 1e-10
"""Residual of Laplace's equation at the end, in the residual of level holes at the mean height."""


def filled(heights: Array, repeats: tuple[bool, bool] = (False, False)) -> Array:
    """Heights with their holes filled from the rims, by Laplace's equation on the samples.

    Each filled sample is the mean of its neighbours. No filled sample is therefore higher or lower than all
    of the rim, and a hole in a plane becomes plane; a hole at a border that does not repeat goes on level.

    Args:
        heights: (rows, cols) in any unit, NaN where nothing was measured.
        repeats: whether the relief is periodic along y (rows) and along x (columns).

    Raises:
        InputError: nothing was measured.
    """
    holes = np.isnan(heights)
    if not holes.any():
        return heights
    if holes.all():
        raise InputError("no sample was measured")
    result = heights.copy()
    at, middle = np.argwhere(holes), float(np.nanmean(heights))
    found = _solution(*_equations(heights - middle, at, repeats), at) + middle
    result[holes] = np.clip(found, np.nanmin(heights), np.nanmax(heights))
    return result


def _equations(heights: Array, at: Index, repeats: tuple[bool, bool]) -> tuple[Any, Array]:
    """Matrix (n, n) and right-hand side (n,) of samples that are each the mean of their neighbours.

    Args:
        heights: (rows, cols).
        at: (n, 2) rows and columns of the samples.
        repeats: as of `filled`.
    """
    # Imported here: SciPy takes long to load, and most reliefs have no holes.
    from scipy.sparse import csr_array, diags_array

    unknowns = np.full(heights.shape, -1, np.int32)
    unknowns[tuple(at.T)] = np.arange(len(at))
    links = csr_array((len(at), len(at)))
    neighbours, right = np.zeros((2, len(at)))
    for axis, step in ((0, 1), (0, -1), (1, 1), (1, -1)):
        place, side = at[:, axis] + step, heights.shape[axis]
        inside = np.full(len(at), repeats[axis]) | (place >= 0) & (place < side)
        beside = np.where(np.arange(2) == axis, (place % side)[:, None], at)[inside].T
        linked = unknowns[tuple(beside)]
        neighbours += inside
        right[inside] += np.where(linked < 0, heights[tuple(beside)], 0.0)
        pairs = np.flatnonzero(inside)[linked >= 0], linked[linked >= 0]
        links += csr_array((np.ones(len(pairs[0])), pairs), shape=links.shape)
    return diags_array(neighbours).tocsr() - links, right


def _solution(matrix: Any, right: Array, at: Index) -> Array:
    """Solve the equations of samples at (n, 2) rows and columns, by conjugate gradients with multigrid.

    Grids become coarser by smoothed aggregation (Vanek, Mandel and Brezina 1996).
    """
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import LinearOperator, cg, splu

    levels = []
    coarse = matrix
    while len(at) > FEWEST_SAMPLES:
        at, parent = np.unique(at // AGGREGATE, axis=0, return_inverse=True)
        jacobi = DAMPING / coarse.diagonal()
        join = csr_array((np.ones(len(parent)), parent, np.arange(len(parent) + 1)))
        prolong = join - (coarse @ join).multiply(jacobi[:, None]).tocsr()
        levels.append((coarse, jacobi, prolong))
        coarse = (prolong.T @ coarse @ prolong).tocsr()
    coarsest = splu(coarse.tocsc())

    def cycle(residual: Array, depth: int = 0) -> Array:
        if depth == len(levels):
            return coarsest.solve(residual)
        fine, jacobi, prolong = levels[depth]
        change = jacobi * residual
        change += prolong @ cycle(prolong.T @ (residual - fine @ change), depth + 1)
        return change + jacobi * (residual - fine @ change)

    found, _ = cg(matrix, right, rtol=ACCURACY, M=LinearOperator(matrix.shape, matvec=cycle))
    return found


def plane(heights: Array, repeats: tuple[bool, bool] = (False, False)) -> tuple[float, float, float]:
    """The plane nearest to the measured samples, by least squares.

    Args:
        heights: (rows, cols), NaN where nothing was measured.
        repeats: whether the relief is periodic along y (rows) and along x (columns), where it has no slope.

    Returns:
        Its slope down the rows and its slope to the right along the columns, in heights' unit a sample, and
        its height in the middle of the heights.
    """
    measured = np.isfinite(heights)
    offset = float(heights[measured].mean())
    rest = np.where(measured, heights, offset) - offset
    down, right = (np.arange(side) - 0.5 * (side - 1) for side in heights.shape)
    # Where nothing has a slope the solution of least norm is 0.
    parts = (down[:, None] * (not repeats[0]), right[None] * (not repeats[1]), np.ones((1, 1)))
    normal = [[float(np.sum(measured * (one * other))) for other in parts] for one in parts]
    found = np.linalg.lstsq(np.array(normal), np.array([np.sum(rest * part) for part in parts]))[0]
    slope_down, slope_right, lift = found.tolist()
    return slope_down, slope_right, offset + lift


def levelled(heights: Array, repeats: tuple[bool, bool] = (False, False)) -> Array:
    """Heights (rows, cols) without the slopes of their `plane`, lifted so that the lowest is 0; NaN stays."""
    slope_down, slope_right, _ = plane(heights, repeats)
    rows, cols = (np.arange(side) for side in heights.shape)
    level = heights - slope_down * rows[:, None] - slope_right * cols
    return level - np.nanmin(level)
