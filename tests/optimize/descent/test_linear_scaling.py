"""Linear scaling, the rival: the relief made taller or lower, and then wider, until it feels right."""

from dataclasses import replace

import numpy as np
import pytest

import tactile
from optimize.descent.linear_scaling import WIDEST, LinearScaling, linear_scaling, scaled_both_ways, stretched
from optimize.descent.targets import Targets
from relief.ground.limits import HEIGHT_LIMIT_MM
from tactile.measures import TouchMeasures
from tests.optimize.conftest import ProblemWith, with_heights

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
        Targets.of(TOLERANCE, roughness=tactile.jnd_scaled(original.means["roughness"], jnd))
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
        Targets.of(TOLERANCE, contact_area_mm2=factor * original.means["contact_area_mm2"])
    )
    scaled = linear_scaling(problem)
    assert scaled is not None
    assert_scaled(problem.heights, scaled, taller=factor < 1.0)
    feel = problem.press(scaled, gradients=False)
    assert problem.targets.relative_error(feel.values) <= 0.1 * TOLERANCE


def test_a_lifted_relief_scales_as_one_on_the_ground(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=1.2 * original.means["roughness"]))
    one, other = (
        linear_scaling(problem),
        linear_scaling(with_heights(problem, problem.heights + 0.7)),
    )
    assert one is not None and other is not None
    np.testing.assert_allclose(one, other, rtol=0.1 * TOLERANCE)


@pytest.mark.parametrize("jnd", [8, 10])
def test_a_roughness_that_three_millimetres_do_not_give_is_out_of_reach(
    problem_with: ProblemWith, original: TouchMeasures, jnd: float
) -> None:
    problem = problem_with(
        Targets.of(TOLERANCE, roughness=tactile.jnd_scaled(original.means["roughness"], jnd))
    )
    assert linear_scaling(problem) is None


def test_a_flat_plate_cannot_be_scaled(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=0.1))
    assert linear_scaling(with_heights(problem, np.full_like(problem.heights, 0.4))) is None


def test_a_relief_of_full_height_can_still_be_lowered(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=0.1))
    tallest = with_heights(problem, HEIGHT_LIMIT_MM * problem.heights / problem.heights.max())
    scaled = linear_scaling(tallest)
    assert scaled is not None
    assert tallest.press(scaled, gradients=False).means["roughness"] == pytest.approx(0.1, rel=TOLERANCE)


def test_a_stretched_wave_is_as_much_longer() -> None:
    x = np.arange(96.0) - 47.5
    for factor in (0.6, 1.0, 1.7):
        wave, longer = (np.broadcast_to(np.cos(0.2 * x / f), (96, 96)) for f in (1.0, factor))
        at = slice(20, 76)  # The mirror shows at the rim.
        np.testing.assert_allclose(stretched(wave, factor)[at, at], longer[at, at], atol=0.02)


def test_a_stretched_relief_keeps_its_range_and_what_is_too_fine_is_blurred() -> None:
    noise = np.random.default_rng(0).random((64, 64))
    np.testing.assert_allclose(stretched(noise, 1.0), noise, atol=1e-9)
    for factor in (1.0 / WIDEST, 1.5, WIDEST):
        found = stretched(noise, factor)
        assert noise.min() <= found.min() and found.max() <= noise.max()
    # Averages of `WIDEST` x `WIDEST` samples.
    assert stretched(noise, 1.0 / WIDEST).std() == pytest.approx(noise.std() / WIDEST, rel=0.3)


def test_what_height_reaches_is_not_scaled_sideways(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=0.8 * original.means["roughness"]))
    np.testing.assert_array_equal(scaled_both_ways(problem), linear_scaling(problem))


def test_what_three_millimetres_do_not_reach_is_scaled_sideways(problem_with: ProblemWith) -> None:
    problem = problem_with(Targets())
    fine = stretched(problem.heights, 0.6)
    tallest = fine - fine.min()
    tallest *= HEIGHT_LIMIT_MM / tallest.max()
    reached = problem.press(tallest, gradients=False).means["roughness"]
    problem = replace(
        problem,
        relief=replace(problem.relief, heights=fine),
        targets=Targets.of(TOLERANCE, roughness=1.2 * reached),
    )
    assert linear_scaling(problem) is None
    scaled = scaled_both_ways(problem)
    assert 0.8 * HEIGHT_LIMIT_MM < scaled.max() <= HEIGHT_LIMIT_MM
    feel = problem.press(scaled, gradients=False)
    assert problem.targets.relative_error(feel.values) <= 0.1 * TOLERANCE


def test_a_roughness_out_of_reach_both_ways_is_missed_by_less_than_the_original_misses_it(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=1.0))
    feel = problem.press(scaled_both_ways(problem), gradients=False)
    missed = problem.targets.relative_error(feel.values)
    assert TOLERANCE < missed < problem.targets.relative_error(original.values)


@pytest.mark.slow
def test_the_method_arrives_in_one_step_from_wherever_it_stands(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    problem = problem_with(Targets.of(TOLERANCE, roughness=1.2 * original.means["roughness"]))
    method = LinearScaling(problem)
    start = method.begin(0, problem.heights, {})
    assert (start.picture_mean, start.picture_rms, start.memory) == (0.0, 0.0, {})
    one = method.advance(start)
    other = method.advance(one)
    assert (one.step, other.step) == (1, 2)
    np.testing.assert_array_equal(one.heights, other.heights)
    assert problem.targets.met(one.values)
    assert one.picture_rms > one.picture_mean > 0.0
