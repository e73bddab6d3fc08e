"""Direct solution of sparse symmetric positive definite systems: Pardiso where it runs, SuperLU elsewhere."""

from __future__ import annotations

import os
import weakref
from collections.abc import Callable
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pypardiso import PyPardisoSolver

Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Map from right-hand sides (n,) or (n, m) to solutions of the same shape."""

SYMMETRIC_POSITIVE_DEFINITE = 2
SYMMETRIC_INDEFINITE = -2
"""Pardiso's matrix types for the upper triangle of a real matrix (`mtype` in Intel's reference)."""


def has_pardiso() -> bool:
    """Whether `pypardiso` is installed (x86 only)."""
    return find_spec("pypardiso") is not None


def factorised(matrix: sp.spmatrix, *, minimum_degree: bool = False, portable: bool = False) -> Solve:
    """Factorise a matrix once, for many right-hand sides.

    Args:
        matrix: symmetric positive definite, (n, n).
        minimum_degree: order the unknowns by minimum degree instead of nested dissection, where Pardiso runs:
            the ordering is faster and the factors of a plane grid are little larger; those of a solid are
            much larger.
        portable: use SuperLU even where Pardiso is installed (slower, same numbers).

    Returns:
        Function from right-hand sides (n,) or (n, m) to solutions of the same shape; the factors are freed
        with the function.
    """
    if portable or not has_pardiso():
        factor = spla.splu(sp.csc_matrix(matrix), permc_spec="COLAMD", options={"SymmetricMode": True})
        return lambda rhs: factor.solve(rhs)

    solver = pardiso_solver(SYMMETRIC_POSITIVE_DEFINITE)
    upper = sp.csr_matrix(sp.triu(matrix, format="csr"))
    upper.sort_indices()
    if minimum_degree:
        # Its second parameter is the ordering; the others are Pardiso's own defaults for this type of matrix.
        for place, value in ((1, 1), (2, 0), (10, 8), (21, 1)):
            solver.set_iparm(place, value)
    solver.factorize(upper)

    def solve(rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(solver.solve(upper, np.asfortranarray(rhs))).reshape(rhs.shape, order="F")

    weakref.finalize(solve, solver.free_memory, everything=True)
    return solve


def pardiso_solver(matrix_type: int) -> PyPardisoSolver:
    """Solver of pypardiso, which is imported here so that this module works without.

    Args:
        matrix_type: `SYMMETRIC_POSITIVE_DEFINITE` or `SYMMETRIC_INDEFINITE`.
    """
    _point_pypardiso_to_its_library()
    from pypardiso import PyPardisoSolver

    return PyPardisoSolver(mtype=matrix_type)


@cache
def _point_pypardiso_to_its_library() -> None:
    """Set the path of MKL's library, for which pypardiso searches the environment (0.6 s a solver)."""
    if "PYPARDISO_MKL_RT" in os.environ:
        return
    try:
        installed = files("mkl") or []
    except PackageNotFoundError:
        return
    libraries = sorted((str(f.locate()) for f in installed if "mkl_rt" in f.name), key=len)
    if libraries:
        os.environ["PYPARDISO_MKL_RT"] = libraries[0]
