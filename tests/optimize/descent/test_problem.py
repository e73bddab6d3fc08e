"""The problem of a descent: errors of targets, gradients of touch, and which heights are allowed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tactile
from optimize.descent.problem import Problem, change_percent, within_limits
from optimize.descent.targets import Targets
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.relief import Relief
from tactile.measures import measure_touch
from tests.optimize.conftest import ProblemWith


def test_the_error_is_the_largest_relative_one() -> None:
    both = Targets.of(0.01, roughness=0.1, contact_area_mm2=50.0)
    assert both.relative_error({"roughness": 0.11, "contact_area_mm2": 49.0}) == pytest.approx(0.1)
    assert both.relative_error({"roughness": 0.101, "contact_area_mm2": 40.0}) == pytest.approx(0.2)


def test_a_quantity_without_a_goal_has_no_error() -> None:
    assert Targets.of(0.01, roughness=0.1).relative_error({"roughness": 0.1, "contact_area_mm2": 3.0}) == 0.0
    area = Targets.of(0.01, contact_area_mm2=50.0)
    assert area.relative_error({"roughness": 7.0, "contact_area_mm2": 50.0}) == 0.0


def test_a_plate_too_small_for_roughness_is_refused_before_any_operator_is_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path))
    with pytest.raises(InputError, match="size_mm: a patch of 1"):
        measure_touch(Relief(np.zeros((16, 16)), 1.0), tactile.Skin(poisson_ratio=0.321), "layer")
    assert not [*tmp_path.iterdir()]


STEP_MM = 1e-7
"""A longer one moves pixels in and out of contact, where the contact area has a kink."""


def difference(problem: Problem, direction: np.ndarray, step: float) -> np.ndarray:
    """Central differences of (roughness, contact area)."""
    there, back = (
        problem.press(problem.heights + sign * step * direction, gradients=False) for sign in (1.0, -1.0)
    )
    change = [there.means[name] - back.means[name] for name in ("roughness", "contact_area_mm2")]
    return np.array(change) / (2.0 * step)


@pytest.mark.usefixtures("tight_contact")
@pytest.mark.parametrize("seed", [0, 1])
def test_both_gradients_predict_the_change_of_the_feel(problem_with: ProblemWith, seed: int) -> None:
    problem = problem_with(Targets.of(0.01, roughness=0.1, contact_area_mm2=50.0))
    direction = np.random.default_rng(seed).standard_normal(problem.heights.shape)
    slopes = problem.press(problem.heights).gradients @ direction.ravel()
    np.testing.assert_allclose(slopes, difference(problem, direction, STEP_MM), rtol=2e-3)


def test_gradients_stand_in_the_order_of_the_targets(problem_with: ProblemWith) -> None:
    goals = {"roughness": 0.1, "contact_area_mm2": 50.0}
    each = [{"roughness": 0.1}, {"contact_area_mm2": 50.0}]
    problems = [problem_with(Targets.of(0.01, **some)) for some in (goals, *each)]
    both, rough, area = (problem.press(problem.heights).gradients for problem in problems)
    np.testing.assert_allclose(both, np.concatenate([rough, area]), atol=1e-12)


def test_a_warm_start_changes_the_time_not_the_feel(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets.of(0.01, roughness=0.1))
    cold = problem.press(problem.heights)
    nearby = problem.press(problem.heights * 1.05)
    warm = problem.press(problem.heights, nearby.pressure)
    assert warm.means["roughness"] == pytest.approx(cold.means["roughness"], rel=1e-6)
    assert warm.means["contact_area_mm2"] == pytest.approx(cold.means["contact_area_mm2"], rel=1e-6)


def test_a_fast_model_feels_about_the_same_in_double_precision(problem_with: ProblemWith) -> None:
    exact = problem_with(Targets.of(0.01, roughness=0.1, contact_area_mm2=50.0))
    fast = replace(exact, touch="quick")
    one, other = (problem.press(exact.heights) for problem in (exact, fast))
    assert other.means["roughness"] == pytest.approx(one.means["roughness"], rel=0.05)
    assert other.means["contact_area_mm2"] == pytest.approx(one.means["contact_area_mm2"], rel=0.05)
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


# Picture change of a step


def test_the_picture_change_of_a_step_counts_the_plate_and_the_weights_of_the_cameras() -> None:
    original = np.full((2, 4, 4), 0.2)
    original[:, 2:] = 0.9
    pictures = original.copy()
    pictures[0, :2] += np.array([0.01, -0.01, 0.03, -0.03])
    plate = np.zeros_like(original)
    plate[:, :2] = 2.0
    mean, rms = change_percent(pictures, original, plate, np.array([0.75, 0.25]))
    assert mean == pytest.approx(0.75 * 10.0)
    assert rms == pytest.approx(np.sqrt(0.75 * 5e-4) / 0.2 * 100.0)
