"""Direct solution of sparse symmetric positive definite systems: Pardiso where it runs, SuperLU elsewhere."""

from __future__ import annotations

import ctypes
import logging
import os
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import PackageNotFoundError, files
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pypardiso import PyPardisoSolver

Solve = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Map from right-hand sides (n,) or (n, m) to solutions of the same shape."""

FEWEST_FOR_THREADS = 50_000
"""Fewest unknowns for which MKL takes more than one thread. Two threads take 0.51 CPU seconds where one takes
0.27 on the equations of a step on 128 x 128 samples, and 2.4 where one takes 2.0 on 256 x 256."""
SYMMETRIC_POSITIVE_DEFINITE = 2
SYMMETRIC_INDEFINITE = -2
"""Pardiso's matrix types for the upper triangle of a real matrix (`mtype` in Intel's reference)."""
ANALYSE_AND_FACTORISE, SOLVE = 12, 33
"""Pardiso's phases."""

_log = logging.getLogger(__name__)


def has_pardiso() -> bool:
    """Whether `pypardiso` is installed (x86 only)."""
    return find_spec("pypardiso") is not None


def factorised(
    matrix: sp.spmatrix, *, minimum_degree: bool = False, single: bool = False, portable: bool = False
) -> Solve:
    """Factorise a matrix once, for many right-hand sides.

    Args:
        matrix: symmetric positive definite, (n, n).
        minimum_degree: order the unknowns by minimum degree instead of nested dissection, where Pardiso runs:
            the ordering is faster and the factors of a plane grid are little larger; those of a solid are
            much larger.
        single: keep the factors in single precision, where Pardiso runs: half the memory and half the time of
            the numbers. Of the equations of a step, solutions are then off by less than 1e-4 of their
            largest value, and in single precision. A matrix that is not positive definite in single precision
            is factorised in double.
        portable: use SuperLU even where Pardiso is installed (slower, same numbers).

    Returns:
        Function from right-hand sides (n,) or (n, m) to solutions of the same shape; the factors are freed
        with the function.
    """
    if portable or not has_pardiso():
        # Here, because all of `scipy.linalg` comes with it, and Pardiso needs none.
        from scipy.sparse.linalg import splu

        factor = splu(sp.csc_matrix(matrix), permc_spec="COLAMD", options={"SymmetricMode": True})
        return lambda rhs: factor.solve(rhs)

    upper = sp.csr_matrix(sp.triu(matrix, format="csr"))
    upper.sort_indices()
    if single:
        _point_pypardiso_to_its_library()
        from pypardiso.pardiso_wrapper import PyPardisoError

        try:
            return _by_pardiso(upper.astype(np.float32), minimum_degree)
        except PyPardisoError:
            _log.info("equations of a step: not positive definite in single precision; double is taken")
    return _by_pardiso(upper, minimum_degree)


def _by_pardiso(upper: sp.csr_matrix, minimum_degree: bool) -> Solve:
    """`factorised` from the upper triangle, whose rows are sorted, in its own precision."""
    solver = pardiso_solver(SYMMETRIC_POSITIVE_DEFINITE)
    dtype = upper.dtype
    if minimum_degree or dtype == np.float32:
        # The second parameter is the ordering; the others are Pardiso's own defaults for this type of matrix.
        ordering = 0 if minimum_degree else 2
        for place, value in ((1, 1), (2, ordering), (10, 8), (21, 1), (28, int(dtype == np.float32))):
            solver.set_iparm(place, value)

    def run(phase: int, rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        # `factorize` and `solve` of the wrapper copy and compare the matrix, and take double precision alone.
        solver.set_phase(phase)
        with _few_threads(solver, upper.shape[0]):
            return np.asarray(solver._call_pardiso(upper, np.asfortranarray(rhs, dtype=dtype)))

    try:
        run(ANALYSE_AND_FACTORISE, np.zeros((upper.shape[0], 1)))
    except BaseException:
        solver.free_memory(everything=True)
        raise

    def solve(rhs: NDArray[np.float64]) -> NDArray[np.float64]:
        return run(SOLVE, rhs).reshape(rhs.shape)

    weakref.finalize(solve, solver.free_memory, everything=True)
    return solve


@contextmanager
def _few_threads(solver: PyPardisoSolver, unknowns: int) -> Iterator[None]:
    """Give MKL one thread in the block if there are few unknowns."""
    if unknowns >= FEWEST_FOR_THREADS:
        yield
        return
    set_threads = solver.libmkl.MKL_Set_Num_Threads_Local
    before = set_threads(ctypes.c_int(1))
    try:
        yield
    finally:
        set_threads(ctypes.c_int(before))


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
