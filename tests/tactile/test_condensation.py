"""A condensed body has the inverse restricted to a few unknowns, and the rest by substitution."""

import numpy as np
import pytest
import scipy.sparse as sp

from tactile.elements.condensation import CHUNK, Condensed, condensed_onto_loads
from tactile.sparse import has_pardiso

SIZE = 300
RANDOM = np.random.default_rng(0)
KEPT = {
    "one": np.array([17]),
    "the first": np.arange(40),
    "the last": np.arange(SIZE - 40, SIZE),
    "scattered": np.sort(RANDOM.choice(SIZE, 60, replace=False)),
    "all but one": np.delete(np.arange(SIZE), 5),
}
EVERY_CHOICE = pytest.mark.parametrize("kept", KEPT.values(), ids=KEPT.keys())
EVERY_SOLVER = pytest.mark.parametrize(
    "portable",
    [
        pytest.param(True, id="SuperLU"),
        pytest.param(
            False,
            id="Pardiso",
            marks=pytest.mark.skipif(not has_pardiso(), reason="pypardiso is not installed"),
        ),
    ],
)


def body(size: int = SIZE) -> sp.csr_matrix:
    """A sparse, symmetric, positive definite matrix without structure, of condition 1e4 or so."""
    half = sp.random(size, size, density=0.01, rng=np.random.default_rng(1), format="csr")
    return sp.csr_matrix(half @ half.T + sp.diags(np.geomspace(1e-3, 10.0, size)))


def condensed(matrix: sp.csr_matrix, kept: np.ndarray, portable: bool) -> Condensed:
    """Condensation onto single unknowns."""
    return condensed_onto_loads(
        matrix, sp.identity(matrix.shape[0], format="csr")[:, kept], portable=portable
    )


def agree(one: np.ndarray, other: np.ndarray, tolerance: float = 1e-10) -> None:
    np.testing.assert_allclose(one, other, rtol=0.0, atol=tolerance * np.abs(other).max())


@EVERY_SOLVER
@EVERY_CHOICE
def test_compliance_is_the_inverse_at_the_kept_unknowns(kept: np.ndarray, portable: bool) -> None:
    compliance = condensed(body(), kept, portable=portable).compliance
    agree(compliance, np.linalg.inv(body().toarray())[np.ix_(kept, kept)])
    np.testing.assert_array_equal(compliance, compliance.T)


@EVERY_SOLVER
@EVERY_CHOICE
def test_solutions_are_in_equilibrium_with_their_forces(kept: np.ndarray, portable: bool) -> None:
    forces = np.random.default_rng(2).normal(size=(kept.size, 3))
    condensate = condensed(body(), kept, portable=portable)
    solution = condensate.solution(forces)
    applied = np.zeros((SIZE, 3))
    applied[kept] = forces
    agree(body() @ solution, applied)
    agree(solution[kept], condensate.compliance @ forces)


@EVERY_SOLVER
def test_as_many_loads_as_one_likes_may_be_given_at_once(portable: bool) -> None:
    kept = KEPT["scattered"]
    forces = np.random.default_rng(3).normal(size=(kept.size, 2 * CHUNK + 3))
    condensate = condensed(body(), kept, portable=portable)
    together = condensate.solution(forces)
    for number in (0, CHUNK - 1, CHUNK, 2 * CHUNK + 2):
        agree(together[:, [number]], condensate.solution(forces[:, [number]]))


@EVERY_SOLVER
def test_more_unknowns_may_be_kept_than_are_solved_for_at_once(portable: bool) -> None:
    size = 2 * CHUNK + 60
    kept = np.sort(RANDOM.choice(size, 2 * CHUNK + 7, replace=False))
    compliance = condensed(body(size), kept, portable=portable).compliance
    agree(compliance, np.linalg.inv(body(size).toarray())[np.ix_(kept, kept)])


@EVERY_SOLVER
def test_bodies_do_not_disturb_one_another(portable: bool) -> None:
    kept = KEPT["scattered"]
    forces = np.random.default_rng(4).normal(size=(kept.size, 2))

    def stiffer(factor: float) -> Condensed:
        return condensed(sp.csr_matrix(factor * body()), kept, portable=portable)

    one = stiffer(1.0)
    first = one.solution(forces)
    other = stiffer(2.0)
    agree(other.solution(forces), 0.5 * first)
    del other
    np.testing.assert_array_equal(one.solution(forces), first)


@pytest.mark.skipif(not has_pardiso(), reason="pypardiso is not installed")
@EVERY_CHOICE
def test_superlu_gives_what_pardiso_gives(kept: np.ndarray) -> None:
    forces = np.random.default_rng(5).normal(size=(kept.size, 3))
    fast, portable = (condensed(body(), kept, portable=p) for p in (False, True))
    agree(fast.compliance, portable.compliance)
    agree(fast.solution(forces), portable.solution(forces))


def patterns(count: int, size: int = SIZE) -> sp.csr_matrix:
    """Sparse loads that share unknowns."""
    return sp.random(size, count, density=0.05, rng=np.random.default_rng(6), format="csr")


@EVERY_SOLVER
@pytest.mark.parametrize("count", [1, 40, SIZE + 20, CHUNK + 3])
def test_loads_are_answered_by_displacements_in_equilibrium(count: int, portable: bool) -> None:
    loads = patterns(count)
    coefficients = np.random.default_rng(7).normal(size=(count, 3))
    condensate = condensed_onto_loads(body(), loads, portable=portable)
    solution = condensate.solution(coefficients)
    agree(body() @ solution, loads @ coefficients)
    agree(condensate.compliance @ coefficients, loads.T @ solution)
    np.testing.assert_array_equal(condensate.compliance, condensate.compliance.T)


@EVERY_SOLVER
def test_a_pattern_that_pushes_nothing_moves_nothing(portable: bool) -> None:
    loads = sp.csr_matrix(sp.hstack((patterns(5), sp.csr_matrix((SIZE, 1)))))
    condensate = condensed_onto_loads(body(), loads, portable=portable)
    assert not condensate.compliance[-1].any()
    agree(condensate.compliance[:5, :5], condensed_onto_loads(body(), patterns(5)).compliance)
