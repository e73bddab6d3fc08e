"""Factors in single precision, as steps take them."""

import numpy as np
import pytest
import scipy.sparse as sp

from tactile.sparse import factorised, has_pardiso


@pytest.mark.parametrize("minimum_degree", [False, True])
def test_single_precision_solves_to_five_digits(minimum_degree: bool) -> None:
    line = sp.diags([-1.0, 2.1, -1.0], [-1, 0, 1], shape=(40, 40))
    matrix = sp.csr_matrix(sp.kron(line, sp.identity(40)) + sp.kron(sp.identity(40), line))
    loads = np.random.default_rng(0).normal(size=(1600, 3))
    exact = factorised(matrix)(loads)
    for rhs, expected in ((loads, exact), (loads[:, 0], exact[:, 0])):
        solved = factorised(matrix, minimum_degree=minimum_degree, single=True)(rhs)
        assert solved.dtype == np.float32
        error = np.abs(solved - expected).max() / np.abs(expected).max()
        assert error < 1e-5
        if has_pardiso():
            assert error > 1e-12


def test_a_matrix_that_single_precision_makes_singular_is_factorised_in_double() -> None:
    near = 1.0 - 1e-10
    matrix = sp.csr_matrix(np.kron(np.identity(50), [[1.0, near], [near, 1.0]]))
    load = np.random.default_rng(1).normal(size=100)
    solved = factorised(matrix, single=True)(load)
    np.testing.assert_allclose(matrix @ solved, load, atol=1e-5)
