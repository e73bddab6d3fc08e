"""Corrections of measured heights: samples that were not measured are filled, a tilt is taken out."""

from typing import Any

import numpy as np

from relief.ground.arrays import AnyArray, Array, Index
from relief.ground.errors import InputError

FEWEST_SAMPLES = 500
"""Samples of the coarsest grid, whose equations are solved directly."""
AGGREGATE = 3
"""Samples along a side of the square that becomes one sample of the next coarser grid."""
DAMPING = 2.0 / 3.0
"""Weight of a Jacobi step, which halves the roughest errors of Laplace's equation and prolongs smoothly."""
ACCURACY = 1e-10
"""Residual of Laplace's equation at the end, in the residual of level holes at the mean height."""
MEASURED, OUTSIDE = -1, -2
"""Numbers of samples that are no unknowns of the equations."""


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
    laplacian, right, ends = _equations(heights - middle, at, repeats)
    result[holes] = np.clip(_solution(laplacian, right, at), *ends) + middle
    return result


def _equations(
    heights: Array, at: Index, repeats: tuple[bool, bool]
) -> tuple[Any, Array, tuple[float, float]]:
    """Laplace's equation of samples at (n, 2) rows and columns, and the extremes of the samples beside them.

    Returns:
        Matrix (n, n) and right-hand side (n,) of heights that are each the mean of their neighbours.
    """
    # Imported here: SciPy takes long to load, and most reliefs have no holes.
    from scipy.sparse import csr_array

    unknowns = np.arange(len(at))
    numbers: AnyArray = np.full(heights.shape, MEASURED, np.int32)
    numbers[tuple(at.T)] = unknowns
    for axis, periodic in enumerate(repeats):
        pad = [(int(axis == 0),) * 2, (int(axis == 1),) * 2]
        numbers = np.pad(numbers, pad, "wrap") if periodic else np.pad(numbers, pad, constant_values=OUTSIDE)
        heights = np.pad(heights, pad, "wrap" if periodic else "edge")
    places = np.ravel_multi_index(tuple(at.T + 1), numbers.shape)
    laplacian, right = csr_array((len(at), len(at))), np.zeros(len(at))
    low, high = np.inf, -np.inf
    for step in (1, -1, numbers.shape[1], -numbers.shape[1]):
        beside, values = numbers.ravel()[places + step], heights.ravel()[places + step]
        rim, linked = beside == MEASURED, beside >= 0
        pairs = (np.concatenate((unknowns, unknowns[linked])), np.concatenate((unknowns, beside[linked])))
        weights = np.concatenate(((beside != OUTSIDE).astype(float), np.full(linked.sum(), -1.0)))
        laplacian += csr_array((weights, pairs), shape=laplacian.shape)
        right[rim] += values[rim]
        low, high = min(low, values[rim].min(initial=np.inf)), max(high, values[rim].max(initial=-np.inf))
    return laplacian, right, (low, high)


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
    by_row, by_col = measured.sum(axis=1), measured.sum(axis=0)
    mixed = float(down @ (measured @ right))
    normal = [
        [by_row @ down**2, mixed, by_row @ down],
        [mixed, by_col @ right**2, by_col @ right],
        [by_row @ down, by_col @ right, by_row.sum()],
    ]
    moments = [down @ rest.sum(axis=1), right @ rest.sum(axis=0), rest.sum()]
    free = np.flatnonzero([not repeats[0], not repeats[1], True])
    found = np.zeros(3)
    found[free] = np.linalg.lstsq(np.array(normal)[np.ix_(free, free)], np.array(moments)[free])[0]
    slope_down, slope_right, lift = found.tolist()
    return slope_down, slope_right, offset + lift


def levelled(heights: Array, repeats: tuple[bool, bool] = (False, False)) -> Array:
    """Heights (rows, cols) without the slopes of their `plane`, lifted so that the lowest is 0; NaN stays."""
    slope_down, slope_right, _ = plane(heights, repeats)
    rows, cols = (np.arange(side) for side in heights.shape)
    level = heights - slope_down * rows[:, None] - slope_right * cols
    return level - np.nanmin(level)
