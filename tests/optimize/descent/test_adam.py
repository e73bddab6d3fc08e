"""Adam, the paper's method down, comes as near to the target as the paper asks for."""

from dataclasses import replace

import numpy as np
import pytest

import tactile
from optimize.descent.adam import AdamDescent
from optimize.descent.driver import check_memory, descend
from optimize.descent.problem import Problem
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from optimize.descent.touch_measures import TouchMeasures
from tests.optimize.conftest import ProblemWith

PAPER_TOLERANCE = 0.1
PAPER_RATE = 0.027


@pytest.fixture
def quick(problem_with: ProblemWith, original: TouchMeasures) -> Problem:
    """Two just-noticeable differences rougher, with few samples a pixel."""
    targets = Targets.of(PAPER_TOLERANCE, roughness=tactile.jnd_scaled(original.values["roughness"], 2))
    return replace(problem_with(targets), samples=4)


def test_the_first_steps_go_toward_the_target(quick: Problem) -> None:
    method = AdamDescent(quick, 100, PAPER_RATE)
    at = method.begin(0, quick.heights, {})
    roughness = [at.values["roughness"]]
    for _ in range(3):
        at = method.advance(at)
        roughness.append(at.values["roughness"])
    assert np.all(np.diff(roughness) > 0.0)
    assert np.abs(at.heights - quick.heights).max() <= 3.3 * PAPER_RATE


@pytest.mark.slow
@pytest.mark.parametrize("jnd", [2, -2])
def test_forty_steps_reach_the_papers_tolerance(
    problem_with: ProblemWith, original: TouchMeasures, jnd: float
) -> None:
    targets = Targets.of(PAPER_TOLERANCE, roughness=tactile.jnd_scaled(original.values["roughness"], jnd))
    problem = replace(problem_with(targets), samples=4)
    method = AdamDescent(problem, 40, PAPER_RATE)
    descent = descend(method, targets, method.begin(0, problem.heights, {}), 40)
    assert descent.reason is StopReason.CONVERGED
    assert targets.relative_error(descent.last.values) < PAPER_TOLERANCE
    # The clamp is a penalty: heights may leave the limits by less than the wavelength of light.
    assert descent.last.heights.min() > -1e-3


def test_both_targets_are_approached_together(quick: Problem, original: TouchMeasures) -> None:
    area = Targets.of(PAPER_TOLERANCE, contact_area_mm2=0.9 * original.values["contact_area_mm2"])
    targets = Targets((*quick.targets.each, *area.each))
    problem = replace(quick, targets=targets)
    method = AdamDescent(problem, 100, PAPER_RATE)
    start = at = method.begin(0, problem.heights, {})
    for _ in range(3):
        at = method.advance(at)
    assert at.values["roughness"] > start.values["roughness"]
    assert at.values["contact_area_mm2"] < start.values["contact_area_mm2"]


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
    method = AdamDescent(quick, 6, PAPER_RATE)
    start = method.begin(0, quick.heights, {})
    first = method.advance(start)
    for reached in (start, first):
        check_memory(reached.memory, method.remembered(reached.heights, reached.memory))
    kept = {name: value.copy() for name, value in first.memory.items()}
    method.advance(first)
    np.testing.assert_array_equal(start.heights, quick.heights)
    for name, value in kept.items():
        np.testing.assert_array_equal(first.memory[name], value)
