"""Broad changes of pictures: weighed as stated, added to solutions, and kept small by descents."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from optimize.descent.driver import descend
from optimize.descent.gauss_newton.broad import RESIDUAL, broad_cells, with_rows
from optimize.descent.gauss_newton.method import ROUGHENING, GaussNewton
from optimize.descent.targets import Targets
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError
from tactile import jnd_scaled
from tactile.measures import TouchMeasures
from tactile.sparse import factorised
from tests.optimize.conftest import ProblemWith


@pytest.mark.parametrize("around", [(False, False), (True, True), (False, True)])
def test_a_change_all_over_counts_by_its_weight_and_fine_ones_do_not(around: tuple[bool, bool]) -> None:
    cells = broad_cells((60, 90), 15.0, 10.0, around)
    all_over = np.square(cells @ np.ones(60 * 90)).sum() / (60 * 90)
    assert all_over == pytest.approx(10.0, rel=1e-9 if all(around) else 0.02)
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


def test_the_load_of_a_step_is_the_slope_of_all_that_it_minimises(problem_with: ProblemWith) -> None:
    """Of pixels, broad cells and shape together, by central differences over the linear pictures."""
    method = GaussNewton(replace(problem_with(Targets.of(0.01, roughness=0.1)), broad=10.0, shape=30.0))
    random = np.random.default_rng(1)
    moved = method._problem.heights + 0.01 * random.normal(size=method._problem.heights.shape)
    look = method._evaluate(moved)
    rise = random.normal(size=moved.shape)
    heights = method._problem.heights + 0.01 * (rise - rise.mean())
    system = method._system(heights, look)
    assert system.broad is not None
    way = random.normal(size=moved.size)
    way -= way.mean()
    bending = method._differences @ (heights - method._problem.heights).ravel()

    def least_squares(share: float) -> float:
        # The bending, which `ROUGHENING` weighs, and the shape beside the pictures.
        total = ROUGHENING * float(np.square(bending + share * (method._differences @ way)).sum())
        risen = (heights - method._problem.heights).ravel() + share * way
        total += 0.5 * 30.0**2 * float(risen @ risen)
        for of in look:
            for number, (jacobian, picture) in enumerate(zip(of.jacobians, of.pictures, strict=True)):
                after = picture.ravel() + share * (jacobian @ way)
                off = after * method._unit - method._target[number].ravel()
                off *= np.sqrt(method._weights[number])
                total += 0.5 * float(off @ (method._smooth @ off) + np.square(method._cells @ off).sum())
        return total

    slope = (least_squares(1e-3) - least_squares(-1e-3)) / 2e-3
    assert -float(system.load @ way) == pytest.approx(slope, rel=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("around", [False, True])
def test_a_descent_changes_broad_brightness_less(
    problem_with: ProblemWith, original: TouchMeasures, around: bool
) -> None:
    targets = Targets.of(0.01, roughness=jnd_scaled(original.means["roughness"], 2.0))
    problem = problem_with(targets)
    problem = replace(problem, look="fast", relief=replace(problem.relief, repeats=(around, around)))
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


def test_a_descent_that_keeps_the_shape_changes_it_less(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    targets = Targets.of(0.01, roughness=jnd_scaled(original.means["roughness"], 2.0))
    problem = replace(problem_with(targets), look="fast")
    risen, percent = [], []
    for shape in (0.0, 20.0):
        method = GaussNewton(replace(problem, shape=shape))
        best = descend(method, targets, method.begin(0, problem.heights, {}), 15).best
        assert targets.met(best.values)
        risen.append(float((best.heights - problem.heights).std()))
        percent.append(best.picture_rms)
        assert best.shape == pytest.approx(100.0 * shape * risen[-1])
    assert risen[1] < 0.8 * risen[0] and percent[1] < 3.0 * percent[0]
