"""Graph Laplacian of height samples or pixels, periodic on axes that repeat."""

import numpy as np
import scipy.sparse as sp


def laplacian(shape: tuple[int, int], repeats: tuple[bool, bool] = (False, False)) -> sp.csr_matrix:
    """Graph Laplacian of samples (rows, cols), positive semi-definite; periodic on axes that repeat."""
    rows, cols = (_differences(n, axis) for n, axis in zip(shape, repeats, strict=True))
    return sp.csr_matrix(
        sp.kron(rows.T @ rows, sp.identity(shape[1])) + sp.kron(sp.identity(shape[0]), cols.T @ cols)
    )


def _differences(n: int, periodic: bool = False) -> sp.csr_matrix:
    inner = sp.csr_matrix(sp.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n)))
    if not periodic:
        return inner
    seam = sp.csr_matrix(([1.0, -1.0], ([0, 0], [0, n - 1])), shape=(1, n))
    return sp.vstack([inner, seam], format="csr")
