"""The equations of a Gauss-Newton step: a sum of squares to which terms add, and its responses to forces."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple, Self

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from optimize.descent.gauss_newton import windows
from optimize.descent.gauss_newton.broad import with_rows
from optimize.descent.gauss_newton.other_fingers import SoftTargets
from relief.ground.arrays import Array
from relief.ground.progress import stage
from relief.patches import Patches
from tactile.sparse import factorised

MANY_SIDES = 32
"""Fewest right-hand sides of a step for which nested dissection is the better ordering. By minimum degree,
factors and 50 solutions on 320 x 320 samples take 1.5 + 1.0 CPU seconds, by nested dissection 1.9 + 0.4; 17
solutions on 128 x 128 samples take as long by either."""

ROWS_AT_ONCE = 512 * 512
"""Rows of the equations that are summed together."""
SMOOTHING = 10.0
"""Weight of the differences between neighbouring samples in the damping."""
ROUGHENING = 3.0
"""Bending weight beta. Bending keeps waves of two samples, which pictures do not show, out of the relief."""


@dataclass
class System:
    """Equations of a step: the sum of squares that the step minimises over the change x (heights,) mm.

    The step solves (matrix + low_rank' low_rank + mu damping) x = load, beside soft targets. Terms
    (`gauss_newton.terms`) add to the sum.

    Attributes:
        matrix, damping: (heights, heights).
        load: (heights,).
        low_rank: blocks (k, heights) of few rows that couple many heights and would fill the factors.
        soft_targets: that the step approaches; None without any.
    """

    matrix: sp.csr_matrix
    damping: sp.csr_matrix
    load: Array
    low_rank: list[sp.csr_matrix] = field(default_factory=list)
    soft_targets: SoftTargets | None = None
    _products: list[tuple[sp.csr_matrix, sp.csr_matrix]] = field(default_factory=list)

    @classmethod
    def of_bending(cls, change: Array, laplacian: sp.csr_matrix, precision: type[np.floating]) -> Self:
        """The damping, and the sum beta |Laplacian(change + x)|² alone.

        Args:
            change: (rows, cols) mm by which the relief differs from the original.
            laplacian: (heights, heights) graph Laplacian of the samples.
            precision: of the matrix.
        """
        bend = (ROUGHENING * (laplacian.T @ laplacian)).tocsr().astype(precision)
        damping = 2.0 * (sp.identity(change.size, format="csr") + SMOOTHING * laplacian)
        return cls(2.0 * bend, damping, -2.0 * (bend @ change.ravel()))

    def add_rows(self, rows: sp.csr_matrix, weighted: sp.csr_matrix, difference: Array) -> None:
        """Add 1/2 |difference + rows x|² in the metric of a matrix W, with `weighted` = W rows."""
        self.load -= weighted.T @ difference
        self._products.append((rows, weighted))
        # One product of all rows saves adding up the products of each condition, but takes more memory.
        if self.load.size > windows.MOST_AT_ONCE:
            self._multiply()

    def add_low_rank(self, rows: sp.csr_matrix, difference: Array) -> None:
        """Add 1/2 |difference + rows x|² of rows that the matrix is factorised without."""
        self.low_rank.append(rows)
        self.load -= rows.T @ difference

    def draw(self, stiffness: float, change: Array) -> None:
        """Add 1/2 stiffness |x - change|², with the change (heights,) mm that each height is drawn to."""
        self._multiply()
        self.matrix = self.matrix + stiffness * sp.identity(len(change), format="csr")
        self.load += stiffness * change

    def finish(self, frozen: NDArray[np.bool_] | None) -> None:
        """End the sum; frozen samples (rows, cols) do not change."""
        self._multiply()
        if frozen is not None:
            # The equation of a frozen sample is x = 0, and no other equation has the sample.
            stay = frozen.ravel()
            free = sp.diags((~stay).astype(np.float64))
            self.load = np.where(stay, 0.0, self.load)
            self.matrix = free @ self.matrix @ free + sp.diags(stay.astype(np.float64))
            self.damping = free @ self.damping @ free
            self.low_rank = [rows @ free for rows in self.low_rank]
        self.low_rank = [stacked(self.low_rank)] if self.low_rank else []

    def _multiply(self) -> None:
        """Add the products of the rows so far to the matrix."""
        if self._products:
            # Transposed into rows: else scipy would convert the larger factor to columns for the product.
            by_height = stacked([rows for rows, _ in self._products]).T.tocsr()
            weighted = stacked([weighted for _, weighted in self._products])
            self.matrix = with_product(self.matrix, by_height, weighted)
            self._products.clear()


class Response(NamedTuple):
    """Changes of the relief: the step that minimises the sum, and the responses to forces on the targets.

    Attributes:
        unconstrained_step: (heights,) mm.
        constraint_responses: (heights, constraints), by a unit force on each target at each place.
    """

    unconstrained_step: Array
    constraint_responses: Array | windows.WindowColumns

    def change(self, forces: Array) -> Array:
        """(heights,) mm, the step under forces (constraints,) on the targets."""
        return self.unconstrained_step + self.constraint_responses @ forces

    def slopes(self, gradients: Array | sp.csr_matrix) -> Array:
        """(constraints, constraints) derivatives of the targets, by their gradients, by the forces."""
        responses = self.constraint_responses
        return gradients @ responses if isinstance(responses, np.ndarray) else responses.under(gradients)


@stage("solving for a step")
def response_of(
    system: System, damping: float, gradients: Array | sp.csr_matrix, patches: Patches
) -> Response:
    """The least squares solved: alone, and for a unit force along each target's gradient.

    Soft targets are terms of low rank, which the matrix is factorised without (Woodbury's formula).
    """
    soft_targets, low_rank = system.soft_targets, stacked(system.low_rank) if system.low_rank else None
    matrix = sp.csr_matrix(system.matrix + damping * system.damping)
    if not isinstance(gradients, np.ndarray) and matrix.shape[0] > windows.MOST_AT_ONCE:
        return Response(*windows.windowed_response(matrix, system.load, gradients, patches, low_rank))
    sides = [system.load, gradients, *(() if soft_targets is None else (soft_targets.gradients,))]
    count = gradients.shape[0]
    # Directions of a step need few digits: the slopes of the targets along them are exact.
    solve = with_rows(factorised(matrix, minimum_degree=count < MANY_SIDES, single=True), low_rank)
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
