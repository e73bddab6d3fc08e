"""Broad changes of pictures: weighed as stated, added to solutions, and kept small by descents."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from optimize.descent.driver import descend
from optimize.descent.gauss_newton.broad import RESIDUAL, broad_cells, with_rows
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.targets import Targets
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError
from tactile import jnd_scaled
from tactile.measures import TouchMeasures
from tactile.sparse import factorised
from tests.optimize.conftest import ProblemWith


@pytest.mark.parametrize("periodic", [(False, False), (True, True), (False, True)])
def test_a_change_all_over_counts_by_its_weight_and_fine_ones_do_not(periodic: tuple[bool, bool]) -> None:
    cells = broad_cells((60, 90), 15.0, 10.0, periodic)
    all_over = np.square(cells @ np.ones(60 * 90)).sum() / (60 * 90)
    assert all_over == pytest.approx(10.0, rel=1e-9 if all(periodic) else 0.02)
    col = np.indices((60, 90))[1].ravel()
    fine, wide = (np.square(cells @ np.cos(2.0 * np.pi * col / period)).mean() for period in (6, 45))
    assert fine < 0.01 * wide


def test_rows_are_added_to_a_solution() -> None:
    random = np.random.default_rng(0)
    factor = sp.random(60, 40, 0.2, random_state=0)
    matrix = sp.csr_matrix(factor.T @ factor + sp.identity(40))
    # As broad rows are, combinations of the rows that the matrix is made of.
    rows = sp.csr_matrix(sp.random(6, 60, 0.3, random_state=1) @ factor)
    sides = random.normal(size=(40, 3))
    found = with_rows(factorised(matrix, single=True), rows)(sides)
    exact = np.linalg.solve((matrix + rows.T @ rows).toarray(), sides)
    error = np.linalg.norm((matrix + rows.T @ rows) @ found - sides, axis=0) / np.linalg.norm(sides, axis=0)
    assert error.max() < 2.0 * RESIDUAL
    assert np.linalg.norm(found - exact) < 2.0 * RESIDUAL * np.linalg.norm(exact)
    alone = with_rows(factorised(matrix, single=True), rows)(sides[:, 0])
    np.testing.assert_allclose(alone, found[:, 0], atol=RESIDUAL * np.abs(found).max())
    # A place that hardly feels anything, and one that feels nothing.
    faint = with_rows(factorised(matrix, single=True), rows)(np.stack([1e-25 * sides[:, 0], np.zeros(40)], 1))
    np.testing.assert_allclose(faint[:, 0], 1e-25 * alone, rtol=1e-3)
    assert not faint[:, 1].any()


@pytest.mark.slow
@pytest.mark.parametrize("periodic", [False, True])
def test_a_descent_changes_broad_brightness_less(
    problem_with: ProblemWith, original: TouchMeasures, periodic: bool
) -> None:
    targets = Targets.of(0.01, roughness=jnd_scaled(original.means["roughness"], 2.0))
    problem = problem_with(targets)
    problem = replace(problem, look="fast", relief=replace(problem.relief, repeats=(periodic, periodic)))
    left = []
    for broad in (0.0, 10.0):
        weighed = replace(problem, broad=broad)
        method = GaussNewton(weighed)
        best = descend(method, targets, method.begin(0, problem.heights, {}), 15).best
        assert targets.met(best.values)
        left.append((GaussNewton(replace(problem, broad=1.0)).begin(0, best.heights, {}), best.broad))
    (before, none), (after, some) = left
    assert none == 0.0 < some
    assert after.broad < 0.7 * before.broad and after.picture_rms < 1.2 * before.picture_rms


def test_methods_without_it_refuse_it() -> None:
    with pytest.raises(InputError, match=r"look\.broad: has no effect by adam; gauss-newton takes it"):
        run_from_scene("studio", "gravel", ["touch.jnd=1", "look.broad=3", "descent.method=adam"])
