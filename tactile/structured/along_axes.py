"""Integrals of hat functions along one axis, of which a tensor grid's stiffness is made."""

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array


def matrices_along(nodes: Array, weights: Array) -> dict[str, sp.csr_matrix]:
    """One-dimensional integrals of linear hats and their slopes, by name.

    "mass" is exact, "centre" takes the value at the middle of each element; "slopes", "slope_value" and
    "value_slope" are the same by either rule.

    Args:
        nodes: (k,) ascending positions, mm.
        weights: (k - 1,) factor of each element's contribution.
    """
    length = np.diff(nodes)
    locals_ = {
        "mass": length[:, None, None] / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]]),
        "centre": length[:, None, None] / 4.0 * np.ones((2, 2)),
        "slopes": 1.0 / length[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]]),
        "slope_value": np.broadcast_to(0.5 * np.array([[-1.0, -1.0], [1.0, 1.0]]), (length.size, 2, 2)),
    }
    first = np.arange(length.size)
    rows = (first[:, None, None] + np.array([[0, 0], [1, 1]])).ravel()
    columns = (first[:, None, None] + np.array([[0, 1], [0, 1]])).ravel()
    matrices = {
        kind: sp.csr_matrix(((weights[:, None, None] * values).ravel(), (rows, columns)), (nodes.size,) * 2)
        for kind, values in locals_.items()
    }
    matrices["value_slope"] = matrices["slope_value"].T.tocsr()
    return matrices


def kinds_along(by_test: int, by_trial: int, mass: str) -> list[str]:
    """Which of `matrices_along` an integral of a product of derivatives takes along each axis.

    Args:
        by_test: axis of the derivative of the test function.
        by_trial: axis of the derivative of the displacement.
        mass: the matrix along axes without a derivative, "mass" or "centre".
    """
    kinds = {(True, True): "slopes", (True, False): "slope_value", (False, True): "value_slope"}
    return [kinds.get((axis == by_test, axis == by_trial), mass) for axis in range(3)]


def fold(half: int, odd: bool) -> sp.csr_matrix:
    """(half + 2, half + 1): the ghost is plus or minus the first pixel."""
    matrix = sp.lil_matrix((half + 2, half + 1))
    matrix[0, 0] = -1.0 if odd else 1.0
    matrix[np.arange(1, half + 2), np.arange(half + 1)] = 1.0
    return matrix.tocsr()
