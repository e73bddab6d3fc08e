"""The equations of a Gauss-Newton step: least squares of the look, and their responses to forces."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from optimize.descent.gauss_newton import windows
from optimize.descent.gauss_newton.broad import with_rows
from optimize.descent.gauss_newton.laplacian import laplacian
from optimize.descent.gauss_newton.other_fingers import SoftTargets
from relief.ground.arrays import Array
from relief.ground.progress import stage
from relief.patches import Patches
from tactile.sparse import factorised

MANY_SIDES = 32
"""Fewest right-hand sides of a step for which nested dissection is the better ordering. By minimum degree,
factors and 50 solutions on 320 x 320 samples take 1.5 + 1.0 CPU seconds, by nested dissection 1.9 + 0.4; 17
on 128 x 128 take as long by either."""

ROWS_AT_ONCE = 512 * 512
"""Rows of the equations that are summed together."""


class System(NamedTuple):
    """Least squares of the look: (matrix + broad' broad + mu damping) x = load.

    Attributes:
        broad: (cells, heights) broad changes of the pictures, each by its weight; None if they do not count.
    """

    matrix: sp.csr_matrix
    damping: sp.csr_matrix
    load: Array
    broad: sp.csr_matrix | None = None


class Response(NamedTuple):
    """Changes of the relief: the step that is best for the look alone, and what constraints add to it.

    Attributes:
        unconstrained_step: (heights,) mm.
        constraint_responses: (heights, constraints), by a unit force on each target at each place.
    """

    unconstrained_step: Array
    constraint_responses: Array | windows.WindowColumns


@stage("solving for a step")
def response_of(
    system: System,
    damping: float,
    gradients: Array | sp.csr_matrix,
    patches: Patches,
    soft_targets: SoftTargets | None = None,
) -> Response:
    """The least squares solved: alone, and for a unit force along each target's gradient.

    Soft targets are terms of low rank beside those of the look, which the
    matrix of the look is factorised without (Woodbury's formula).
    """
    matrix = sp.csr_matrix(system.matrix + damping * system.damping)
    if not isinstance(gradients, np.ndarray) and matrix.shape[0] > windows.MOST_AT_ONCE:
        return Response(
            *windows.windowed_response(matrix, system.load, gradients, patches, broad=system.broad)
        )
    sides = [system.load, gradients, *(() if soft_targets is None else (soft_targets.gradients,))]
    count = gradients.shape[0]
    # Directions of a step need few digits: the slopes of the targets along them are exact.
    solve = with_rows(factorised(matrix, minimum_degree=count < MANY_SIDES, single=True), system.broad)
    rows = windows.solved_sides(solve, *sides)
    if soft_targets is None and not isinstance(gradients, np.ndarray):
        return Response(rows[0].astype(np.float64), windows.in_one(rows[1:]))
    solved = rows.T.astype(np.float64)
    if soft_targets is not None:
        solved, by_soft = np.split(solved, [1 + count], axis=1)
        own = np.diag(1.0 / soft_targets.stiffness) + soft_targets.gradients @ by_soft
        missing = -soft_targets.gradients @ solved
        missing[:, 0] += soft_targets.wanted
        solved = solved + by_soft @ np.linalg.solve(own, missing)
    return Response(solved[:, 0], solved[:, 1:])


def stacked(blocks: list[sp.csr_matrix]) -> sp.csr_matrix:
    """Blocks of rows as one matrix; one block without a copy."""
    return blocks[0] if len(blocks) == 1 else sp.vstack(blocks, format="csr")


def with_product(matrix: sp.csr_matrix, left: sp.csr_matrix, right: sp.csr_matrix) -> sp.csr_matrix:
    """matrix + left @ right, by bands of rows, so that the product of a large surface is never whole."""
    ends = range(0, matrix.shape[0] + ROWS_AT_ONCE, ROWS_AT_ONCE)
    bands = [slice(*each) for each in pairwise(ends)]
    return stacked([matrix[band] + left[band] @ right for band in bands])


def picture_weight(shape: tuple[int, int], regularisation: float, around: tuple[bool, bool]) -> sp.csr_matrix:
    """W = I + w2 D'D on the pixels of a picture, whose axes may go around."""
    return sp.csr_matrix(sp.identity(shape[0] * shape[1]) + regularisation * laplacian(shape, around))
