"""Linear scaling, the rival: the relief made taller or lower until it feels right."""

from dataclasses import replace

import numpy as np
import pytest

import tactile
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.targets import Targets
from optimize.descent.touch_measures import TouchMeasures
from relief.limits import HEIGHT_LIMIT_MM
from tests.optimize.conftest import ProblemWith

TOLERANCE = 0.01


def assert_scaled(heights: np.ndarray, scaled: np.ndarray, taller: bool) -> None:
    """The relief times one number, on the ground."""
    relief = heights - heights.min()
    factor = scaled.max() / relief.max()
    np.testing.assert_allclose(scaled, factor * relief, atol=1e-12)
    assert (factor > 1.0) == taller
    assert scaled.max() <= HEIGHT_LIMIT_MM


@pytest.mark.parametrize("jnd", [2, 1, -1, -3])
def test_a_roughness_within_reach_is_met(
    problem_with: ProblemWith, original: TouchMeasures, jnd: float
) -> None:
    problem = problem_with(
        Targets.of(TOLERANCE, roughness=tactile.jnd_scaled(original.values["roughness"], jnd))
    )
    scaled = linear_scaling(problem)
    assert scaled is not None
    assert_scaled(problem.heights, scaled, taller=jnd > 0)
    feel = problem.press(scaled, gradients=False)
    assert problem.targets.relative_error(feel.values) <= 0.1 * TOLERANCE


@pytest.mark.parametrize("factor", [0.8, 1.2])
def test_a_contact_area_within_reach_is_met(
    problem_with: ProblemWith, original: TouchMeasures, factor: float
) -> None:
    problem = problem_with(
        Targets.of(TOLERANCE, contact_area_mm2=factor * original.values["contact_area_mm2"])
    )
    scaled = linear_scaling(problem)
    assert scaled is not None
    assert_scaled(problem.heights, scaled, taller=factor < 1.0)
    feel = problem.press(scaled, gradients=False)
    assert problem.targets.relative_error(feel.values) <= 0.1 * TOLERANCE


def test_a_lifted_relief_scales_as_one_on_the_ground(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=1.2 * original.values["roughness"]))
    one, other = linear_scaling(problem), linear_scaling(replace(problem, heights=problem.heights + 0.7))
    assert one is not None and other is not None
    np.testing.assert_allclose(one, other, rtol=0.1 * TOLERANCE)


@pytest.mark.parametrize("jnd", [8, 10])
def test_a_roughness_that_three_millimetres_do_not_give_is_out_of_reach(
    problem_with: ProblemWith, original: TouchMeasures, jnd: float
) -> None:
    problem = problem_with(
        Targets.of(TOLERANCE, roughness=tactile.jnd_scaled(original.values["roughness"], jnd))
    )
    assert linear_scaling(problem) is None


def test_a_flat_plate_cannot_be_scaled(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=0.1))
    assert linear_scaling(replace(problem, heights=np.full_like(problem.heights, 0.4))) is None


def test_a_relief_of_full_height_can_still_be_lowered(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=0.1))
    tallest = replace(problem, heights=HEIGHT_LIMIT_MM * problem.heights / problem.heights.max())
    scaled = linear_scaling(tallest)
    assert scaled is not None
    assert tallest.press(scaled, gradients=False).values["roughness"] == pytest.approx(0.1, rel=TOLERANCE)
