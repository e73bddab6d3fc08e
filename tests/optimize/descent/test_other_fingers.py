"""Other fingers: felt as by whole presses, with gradients, and drawn to the change of the steered finger."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import torch

import tactile
from optimize.descent.driver import DescentResult, descend
from optimize.descent.gauss_newton.equations import System, response_of
from optimize.descent.gauss_newton.method import LEAST_GAIN, GaussNewton
from optimize.descent.gauss_newton.other_fingers import JND, FingersFelt, OtherFingers, SoftTargets
from optimize.descent.problem import FingerRange, Problem
from optimize.descent.targets import Targets
from relief.patches import Patches
from relief.places import places
from relief.surface import Surface
from tactile.fingers import fingers, roughness_by_finger
from tactile.measures import TouchMeasures
from tests.optimize.conftest import ProblemWith

STIFFER_ONLY = (0, 1)
"""Fingers of the set without the steered one that are of another stiffness only."""
FACTOR = np.array([tactile.jnd_scaled(1.0, 1.0)])


@pytest.fixture(scope="module")
def problem(problem_with: ProblemWith) -> Problem:
    """The waves, pressed in double precision."""
    return replace(problem_with(Targets()), precision=torch.float64)


@pytest.fixture(scope="module")
def others(problem: Problem) -> OtherFingers:
    return OtherFingers(replace(problem, fingers=FingerRange(FACTOR, 20.0)), 1.0)


@pytest.fixture(scope="module")
def felt(problem: Problem, others: OtherFingers) -> FingersFelt:
    return others.press(problem.heights)


def test_fingers_feel_what_whole_presses_feel(problem: Problem, felt: FingersFelt) -> None:
    heights = torch.as_tensor(problem.heights)
    for number in STIFFER_ONLY:
        skin = fingers(problem.skin)[1 + number].skin
        strain = tactile.press(heights, problem.relief.width_mm, skin).strain
        expected = float(tactile.roughness(strain, problem.relief.width_mm, "polar"))
        assert felt.values[number] == pytest.approx(expected, rel=1e-6)


def test_fingers_feel_what_results_tell_of_them(problem: Problem, felt: FingersFelt) -> None:
    """But for the polar sum of roughness, and single precision."""
    expected = roughness_by_finger(problem.heights[None], problem.skin, problem.relief.width_mm)[1:, 0]
    np.testing.assert_allclose(felt.values, expected, rtol=0.01)


@pytest.mark.usefixtures("tight_contact")
def test_gradients_are_those_of_finite_differences(
    problem: Problem, others: OtherFingers, felt: FingersFelt
) -> None:
    step = 1e-5
    for direction in (felt.gradients.sum(0), np.random.default_rng(0).normal(size=felt.gradients.shape[1])):
        unit = (direction / np.linalg.norm(direction)).reshape(problem.heights.shape)
        forward, back = (others.press(problem.heights + sign * step * unit).values for sign in (1.0, -1.0))
        measured = (forward - back) / (2.0 * step)
        scale = 0.1 * np.linalg.norm(felt.gradients, axis=1)
        error = np.abs(felt.gradients @ unit.ravel() - measured) / np.maximum(np.abs(measured), scale)
        assert error.max() < 2e-3


def test_distances_count_in_jnd(felt: FingersFelt) -> None:
    """The original is one just-noticeable difference below goals that are one above the original."""
    np.testing.assert_allclose(felt.jnd_off, -1.0, rtol=1e-6)
    assert felt.percent == pytest.approx(20.0)
    met = replace(felt, values=felt.goals)
    assert met.percent == 0.0 and not met.soft_targets().wanted.any()


def test_the_slope_of_a_soft_target_is_the_derivative_of_what_is_minimised(felt: FingersFelt) -> None:
    """The sum is half of the stiffness times the mean square distance; its model has its slope by values."""
    values = felt.goals * np.exp(JND * np.array([0.3, -0.2, 0.1, 0.4]))
    near = replace(felt, values=values, stiffness=7.0)

    def energy(at: np.ndarray) -> float:
        return 0.5 * 7.0 * float(np.square(replace(near, values=at).jnd_off).mean())

    soft = near.soft_targets()
    for number, pull in enumerate(soft.stiffness * soft.wanted):
        step = 1e-6 * values * (np.arange(4) == number)
        slope = (energy(values + step) - energy(values - step)) / (2.0 * step[number])
        assert -pull == pytest.approx(slope, rel=1e-6)


def test_soft_targets_are_terms_of_the_least_squares() -> None:
    random = np.random.default_rng(0)
    matrix = random.normal(size=(12, 12))
    system = System(sp.csr_matrix(matrix @ matrix.T), sp.csr_matrix(np.eye(12)), random.normal(size=12))
    gradients, by_others = random.normal(size=(2, 3, 12))
    soft = SoftTargets(by_others, random.normal(size=3), np.array([0.5, 30.0, 1e3]))
    system.soft_targets = soft
    plate = Surface((3, 4), 10.0)
    response = response_of(system, 0.7, gradients, Patches(plate, places(plate)))
    weighted = by_others.T * soft.stiffness
    whole = matrix @ matrix.T + 0.7 * np.eye(12) + weighted @ by_others
    # Steps are solved by factors in single precision.
    wanted = np.linalg.solve(whole, np.column_stack((system.load + weighted @ soft.wanted, gradients.T)))
    np.testing.assert_allclose(response.unconstrained_step, wanted[:, 0], atol=1e-5 * np.abs(wanted).max())
    assert isinstance(response.constraint_responses, np.ndarray)
    np.testing.assert_allclose(response.constraint_responses, wanted[:, 1:], atol=1e-5 * np.abs(wanted).max())


@pytest.mark.slow
def test_fingers_come_closer_and_the_pictures_pay(problem_with: ProblemWith, original: TouchMeasures) -> None:
    """The steered finger meets its target all the same; spread and change follow the weight."""
    goal = FACTOR**2 * original.values["roughness"]
    aiming = problem_with(Targets.of(0.01, roughness=goal))

    def walk(weight: float) -> tuple[DescentResult, np.ndarray]:
        wanted = FingerRange(FACTOR**2, weight)
        with_others = replace(aiming, fingers=wanted)
        problem = with_others if weight else aiming
        method = GaussNewton(problem)
        found = descend(method, problem.targets, method.begin(0, problem.heights, {}), 20)
        felt = OtherFingers(with_others, 1.0)
        after = felt.press(found.best.heights)
        assert found.best.fingers == pytest.approx(after.percent, rel=0.02)
        return found, after.jnd_off

    found, spreads = zip(*(walk(weight) for weight in (0.0, 20.0, 80.0)), strict=True)
    assert all(one.reason.met for one in found)
    changes = [one.best.picture_rms for one in found]
    rms = [float(np.sqrt(np.square(off).mean())) for off in spreads]
    # A descent for the look alone ends where its next step promises less than this.
    assert changes[0] < (1.0 + LEAST_GAIN) * changes[1] < changes[2]
    assert rms[0] > 1.2 * rms[1] > 1.2 * 1.2 * rms[2]


@pytest.mark.slow
def test_a_descent_goes_on_from_its_memory_as_it_would_have(
    problem_with: ProblemWith, original: TouchMeasures
) -> None:
    targets = Targets.of(0.01, roughness=FACTOR**2 * original.values["roughness"])
    problem = replace(problem_with(targets), fingers=FingerRange(FACTOR**2, 20.0))
    method = GaussNewton(problem)
    # The second step is pressed from the pressures of the first.
    halfway = method.advance(method.advance(method.begin(0, problem.heights, {})))
    whole = method.advance(halfway)
    again = GaussNewton(problem)
    begun = again.begin(halfway.step, halfway.heights, halfway.memory)
    np.testing.assert_array_equal(begun.memory["fingers"], halfway.memory["fingers"])
    np.testing.assert_allclose(again.advance(begun).heights, whole.heights, atol=1e-9)
    # What is no pressure of these fingers is not started from.
    strange = again.begin(halfway.step, halfway.heights, halfway.memory | {"fingers": np.ones((1, 2, 2))})
    assert strange.fingers == pytest.approx(begun.fingers, rel=1e-3)
