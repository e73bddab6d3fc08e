"""Adam, the paper's way down, comes as near to the target as the paper asks for."""

from dataclasses import replace

import numpy as np
import pytest

import tactile
from optimize.descent.adam import AdamDescent
from optimize.descent.driver import StopReason, descend
from optimize.descent.problem import Feel, Problem, Targets
from tests.optimize.conftest import ProblemWith

PAPER_TOLERANCE = 0.1
PAPER_RATE = 0.027


@pytest.fixture
def quick(problem_with: ProblemWith, original: Feel) -> Problem:
    """Two just-noticeable differences rougher, with few samples a pixel."""
    targets = Targets(tactile.jnd_scaled(original.roughness, 2), None, PAPER_TOLERANCE)
    return replace(problem_with(targets), samples=4)


def test_the_first_steps_go_toward_the_target(quick: Problem) -> None:
    way = AdamDescent(quick, 100, PAPER_RATE)
    at = way.begin(0, quick.heights, {})
    roughness = [at.roughness]
    for _ in range(3):
        at = way.advance(at)
        roughness.append(at.roughness)
    assert np.all(np.diff(roughness) > 0.0)
    assert np.abs(at.heights - quick.heights).max() <= 3.3 * PAPER_RATE


@pytest.mark.slow
@pytest.mark.parametrize("jnd", [2, -2])
def test_forty_steps_reach_the_papers_tolerance(
    problem_with: ProblemWith, original: Feel, jnd: float
) -> None:
    targets = Targets(tactile.jnd_scaled(original.roughness, jnd), None, PAPER_TOLERANCE)
    problem = problem_with(targets)
    way = AdamDescent(problem, 40, PAPER_RATE)
    descent = descend(way, targets, way.begin(0, problem.heights, {}), 40)
    assert descent.reason is StopReason.CONVERGED
    assert targets.miss(descent.last.roughness, descent.last.contact_area_mm2) < PAPER_TOLERANCE
    # The clamp is a penalty: heights may leave the limits by less than the wavelength of light.
    assert descent.last.heights.min() > -1e-3


def test_both_targets_are_approached_together(quick: Problem, original: Feel) -> None:
    targets = replace(quick.targets, contact_area_mm2=0.9 * original.contact_area_mm2)
    problem = replace(quick, targets=targets)
    way = AdamDescent(problem, 100, PAPER_RATE)
    start = at = way.begin(0, problem.heights, {})
    for _ in range(3):
        at = way.advance(at)
    assert at.roughness > start.roughness
    assert at.contact_area_mm2 < start.contact_area_mm2


def test_it_goes_on_from_its_memory_as_if_it_had_not_stopped(quick: Problem) -> None:
    first = AdamDescent(quick, 6, PAPER_RATE)
    middle = first.begin(0, quick.heights, {})
    for _ in range(2):
        middle = first.advance(middle)
    second = AdamDescent(quick, 6, PAPER_RATE)
    resumed = second.begin(2, middle.heights, middle.memory)
    straight = middle
    for _ in range(2):
        straight, resumed = first.advance(straight), second.advance(resumed)
    assert resumed.step == straight.step == 4
    np.testing.assert_allclose(resumed.heights, straight.heights, atol=1e-6)


def test_an_iterate_is_not_changed_by_later_steps(quick: Problem) -> None:
    way = AdamDescent(quick, 6, PAPER_RATE)
    start = way.begin(0, quick.heights, {})
    first = way.advance(start)
    kept = {name: value.copy() for name, value in first.memory.items()}
    way.advance(first)
    np.testing.assert_array_equal(start.heights, quick.heights)
    for name, value in kept.items():
        np.testing.assert_array_equal(first.memory[name], value)
