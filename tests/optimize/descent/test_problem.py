"""What a descent works on: how far off a feel is, what raises it, and which heights are allowed."""

from dataclasses import replace

import numpy as np
import pytest

from optimize.descent.problem import Problem, Targets, within_limits
from relief.limits import HEIGHT_LIMIT_MM
from tests.optimize.conftest import ProblemWith


def test_the_miss_is_the_larger_of_both_relative_ones() -> None:
    both = Targets(roughness=0.1, contact_area_mm2=50.0, tolerance=0.01)
    assert both.miss(0.11, 49.0) == pytest.approx(0.1)
    assert both.miss(0.101, 40.0) == pytest.approx(0.2)


def test_a_feel_that_is_not_asked_for_is_never_missed() -> None:
    assert Targets(0.1, None, 0.01).miss(0.1, 3.0) == 0.0
    assert Targets(None, 50.0, 0.01).miss(7.0, 50.0) == 0.0


STEP_MM = 1e-7
"""A longer one moves pixels in and out of contact, where the contact area has a kink."""


def difference(problem: Problem, direction: np.ndarray, step: float) -> np.ndarray:
    """Central differences of (roughness, contact area)."""
    there, back = (
        problem.feel(problem.heights + sign * step * direction, gradients=False) for sign in (1.0, -1.0)
    )
    change = (there.roughness - back.roughness, there.contact_area_mm2 - back.contact_area_mm2)
    return np.array(change) / (2.0 * step)


@pytest.mark.parametrize("seed", [0, 1])
def test_both_gradients_predict_the_change_of_the_feel(problem_with: ProblemWith, seed: int) -> None:
    problem = problem_with(Targets(0.1, 50.0, 0.01))
    direction = np.random.default_rng(seed).standard_normal(problem.heights.shape)
    slopes = problem.feel(problem.heights).gradients @ direction.ravel()
    np.testing.assert_allclose(slopes, difference(problem, direction, STEP_MM), rtol=2e-3)


def test_gradients_stand_in_the_order_roughness_contact_area(problem_with: ProblemWith) -> None:
    asked = [Targets(0.1, 50.0, 0.01), Targets(0.1, None, 0.01), Targets(None, 50.0, 0.01)]
    problems = [problem_with(targets) for targets in asked]
    both, rough, area = (problem.feel(problem.heights).gradients for problem in problems)
    np.testing.assert_allclose(both, np.concatenate([rough, area]), atol=1e-12)


def test_a_warm_start_changes_the_time_not_the_feel(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets(0.1, None, 0.01))
    cold = problem.feel(problem.heights)
    nearby = problem.feel(problem.heights * 1.05)
    warm = problem.feel(problem.heights, nearby.pressure)
    assert warm.roughness == pytest.approx(cold.roughness, rel=1e-6)
    assert warm.contact_area_mm2 == pytest.approx(cold.contact_area_mm2, rel=1e-6)


def test_a_fast_model_feels_about_the_same_in_double_precision(problem_with: ProblemWith) -> None:
    exact = problem_with(Targets(0.1, 50.0, 0.01))
    fast = replace(exact, touch="quick")
    one, other = (problem.feel(exact.heights) for problem in (exact, fast))
    assert other.roughness == pytest.approx(one.roughness, rel=0.05)
    assert other.contact_area_mm2 == pytest.approx(one.contact_area_mm2, rel=0.05)
    assert other.gradients.dtype == other.strain.dtype == other.pressure.dtype == np.float64
    for ours, theirs in zip(other.gradients, one.gradients, strict=True):
        assert ours @ theirs > 0.9 * np.linalg.norm(ours) * np.linalg.norm(theirs)


@pytest.mark.parametrize("offset", [-1.0, -0.4, 0.0, 0.5, 2.5])
def test_a_relief_that_fits_is_moved_as_a_whole(offset: float) -> None:
    heights = np.random.default_rng(0).uniform(0.0, 2.0, (8, 8)) + offset
    kept = within_limits(heights)
    assert kept.min() >= 0.0 and kept.max() <= HEIGHT_LIMIT_MM
    assert np.ptp(kept - heights) < 1e-12


def test_a_relief_within_the_limits_stays() -> None:
    heights = np.random.default_rng(0).uniform(0.4, 2.0, (8, 8))
    np.testing.assert_array_equal(within_limits(heights), heights)


@pytest.mark.parametrize("offset", [-3.0, 0.0, 3.0])
def test_a_relief_too_tall_to_fit_loses_its_peaks_not_its_valleys(offset: float) -> None:
    heights = np.linspace(0.0, 4.0, 64).reshape(8, 8)
    np.testing.assert_allclose(within_limits(heights + offset), np.minimum(heights, 3.0), atol=1e-12)
