"""Broad changes of pictures: low-pass rows of the least squares, by means over cells of several millimetres.

The contrast of a texture masks fine changes, and nearly nothing masks a change of brightness over several
millimetres: most of the difference that ColorVideoVDP finds between a texture and a result that keeps the
pictures by least squares lies below 3 cycles a degree. Means over broad cells of the pictures therefore are
rows of the least squares beside the pixels. There are few cells, but each couples all heights around it, so
that the rows would fill a factor: conjugate gradients add the rows to a solution without them.
"""

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import AnyArray
from tactile.sparse import Solve

CELL_MM = 1.7
"""Distance of the cells on the plate, mm: 0.24 degrees from 40 cm away. Of 1.25, 1.7 and 2.5 mm, the first
distance takes the most time and the last leaves the most visible change."""
FEWEST = 3
"""Fewest cells along a side of a picture."""
LEAST_CELL = 0.05
"""Least weight of a cell that is kept, in units of the largest weight: splines with middles beyond the sides
have less."""
RESIDUAL, MOST_ITERATIONS = 0.02, 30
"""Relative residual at which a solution is good enough for a step, and most iterations for it."""


def broad_cells(
    shape: tuple[int, int], pitch: float, weight: float, periodic: tuple[bool, bool]
) -> sp.csr_matrix:
    """Matrix (cells, pixels) whose product with a change of a picture is, squared and summed, its broad part.

    Cells are quadratic splines that add up to one everywhere, and each row is a mean by the root of its
    pixels: of a change that is the same all over, the sum is `weight` times that over the pixels.

    Args:
        shape: (rows, cols) of the picture.
        pitch: distance of the cells, pixels.
        weight: of a broad change beside the same change of every pixel.
        periodic: whether the picture repeats along rows and along columns.
    """
    rows, cols = (
        _splines(n, max(FEWEST, round(n / pitch)), own) for n, own in zip(shape, periodic, strict=True)
    )
    means = sp.csr_matrix(sp.kron(rows, cols))
    pixels = np.asarray(means.sum(axis=1)).ravel()
    kept = pixels > LEAST_CELL * pixels.max()
    return sp.csr_matrix(sp.diags(np.sqrt(weight / pixels[kept])) @ means[kept])


def _splines(length: int, count: int, periodic: bool) -> sp.csr_matrix:
    """(splines, length) quadratic splines along an axis, `count` on its length, which add up to one."""
    at = (np.arange(length) + 0.5) * count / length
    away = at - (np.arange(-1, count + 1) + 0.5)[:, None]
    if periodic:
        away = (away[1:-1] + 0.5 * count) % count - 0.5 * count
    away = np.abs(away)
    return sp.csr_matrix(np.where(away < 0.5, 0.75 - away**2, 0.5 * np.clip(1.5 - away, 0.0, None) ** 2))


def with_rows(solve: Solve, rows: sp.csr_matrix | None) -> Solve:
    """Solutions of (matrix + rows' rows) x = side, from those of matrix x = side, by conjugate gradients.

    The matrix is the preconditioner. With the pixels' own least squares in the matrix, no direction grows by
    more than the weight of the rows, and ten iterations do.

    Args:
        solve: of sides (n,) or (n, m), by the matrix.
        rows: (k, n); None: nothing is added.
    """
    if rows is None:
        return solve
    forward = rows.astype(np.float32)
    back = forward.T.tocsr()

    def added(sides: AnyArray) -> AnyArray:
        columns = np.asarray(sides, dtype=np.float32).reshape(len(sides), -1)
        # Columns of length 1, as products of small numbers vanish in single precision.
        size = np.sqrt(np.einsum("nm,nm->m", columns, columns, dtype=np.float64)).astype(np.float32)
        residual = columns / np.where(size > 0.0, size, 1.0)
        solution = np.zeros_like(residual)
        # The matrix times a preconditioned residual is the residual: the matrix is never multiplied.
        along, product = np.zeros_like(residual), np.zeros_like(residual)
        before = np.full(len(size), np.inf)
        for _ in range(MOST_ITERATIONS):
            left = np.flatnonzero(np.linalg.norm(residual, axis=0) > RESIDUAL)
            if not len(left):
                break
            some = residual[:, left]
            near = np.asarray(solve(some)).reshape(some.shape)
            energy = np.einsum("nm,nm->m", near, some)
            along[:, left] = near + energy / before[left] * along[:, left]
            product[:, left] = some + energy / before[left] * product[:, left]
            whole = product[:, left] + back @ (forward @ along[:, left])
            step = energy / np.einsum("nm,nm->m", along[:, left], whole)
            solution[:, left] += step * along[:, left]
            residual[:, left] -= step * whole
            before[left] = energy
        return np.asarray((solution * size).reshape(np.shape(sides)))

    return added
