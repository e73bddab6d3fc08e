"""What the verification does not confirm corrects the aim, and the descent goes on from where it is."""

from collections.abc import Callable

import numpy as np
import pytest

from optimize.descent.correction import STEPS_A_ROUND, Course, Leg, Plan, descend_in_rounds, first_aim
from optimize.descent.driver import Iterate, StopReason
from optimize.descent.problem import Targets
from optimize.descent.verification import TouchMeasured

Array = np.ndarray
TARGETS = Targets(0.1, None, 0.01)
BOTH = Targets(0.1, 50.0, 0.01)
NOTHING = np.zeros((2, 2))
FIRST_STEPS = 3


def iterate(step: int, roughness: float, area: float) -> Iterate:
    """The heights of the first two pixels are the roughness and the contact area that are believed."""
    return Iterate(step, np.array([[roughness, area]]), roughness, area, 0.5, 1.0, 1.0, {})


class Straight:
    """A way down that believes itself at its aim after one step."""

    patience: int | None = 1

    def __init__(self, aim: Targets) -> None:
        self.aim = aim

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        return iterate(step, *heights[0])

    def advance(self, current: Iterate) -> Iterate:
        roughness = self.aim.roughness or current.roughness
        return iterate(current.step + 1, roughness, self.aim.contact_area_mm2 or current.contact_area_mm2)


class Stopped(Straight):
    """One that is interrupted after its first step."""

    def advance(self, current: Iterate) -> Iterate:
        if current.step > 0:
            raise KeyboardInterrupt
        return super().advance(current)


class Silent:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.rounds: list[Course] = []

    def step(self, current: Iterate, best: Iterate, seconds: float) -> None:
        self.steps.append(current.step)

    def verifying(self) -> None:
        pass

    def round(self, course: Course, start: Iterate, steps: int) -> None:
        assert steps == FIRST_STEPS + len(course.rounds) * STEPS_A_ROUND
        self.rounds.append(course)


def truth_of(roughness: Callable[[float], float], area: Callable[[float], float] = float):
    """A verification by functions of what is believed."""

    def verify(heights: Array) -> TouchMeasured:
        v, a = heights[0]
        return TouchMeasured("fem", 8, roughness(v), area(a), 0.5, NOTHING, NOTHING)

    return verify


def walk(targets: Targets, verify, corrections: int = 3, way: type[Straight] = Straight):
    plan = Plan(targets, FIRST_STEPS, corrections, lambda aim, _: way(aim), verify)
    watch = Silent()
    leg = Leg(way(targets), iterate(0, 0.05, 60.0))
    return *descend_in_rounds(plan, Course(targets), leg, watch), watch


def test_a_model_that_is_off_by_a_factor_is_corrected_in_one_round() -> None:
    descent, found, course, _ = walk(TARGETS, truth_of(lambda v: 1.1 * v))
    assert [r.aimed_roughness for r in course.rounds] == pytest.approx([0.1, 0.1 / 1.1])
    assert [r.miss for r in course.rounds] == pytest.approx([0.1, 0.0], abs=1e-12)
    assert found is not None and found.roughness == pytest.approx(0.1)
    assert descent.reason is StopReason.CONVERGED


def test_roughness_and_contact_area_are_corrected_together() -> None:
    verify = truth_of(lambda v: 0.9 * v, lambda a: a + 4.0)
    descent, found, course, _ = walk(BOTH, verify)
    assert found is not None
    assert BOTH.miss(found.roughness, found.contact_area_mm2) <= BOTH.tolerance
    assert 1 < len(course.rounds) <= 3 and descent.reason.met


def test_steps_are_numbered_on_and_rounds_told() -> None:
    descent, _, course, watch = walk(TARGETS, truth_of(lambda v: v + 0.02))
    assert watch.steps == list(range(1, descent.last.step + 1))
    assert [len(c.rounds) for c in watch.rounds] == list(range(1, len(course.rounds)))


def test_a_confirmed_result_ends_it_at_once() -> None:
    _, _, course, watch = walk(TARGETS, truth_of(lambda v: 1.005 * v))
    assert len(course.rounds) == 1 and watch.rounds == []


def test_without_verification_the_descent_is_believed() -> None:
    descent, found, course, _ = walk(TARGETS, None)
    assert found is None and course.rounds == () and descent.reason is StopReason.CONVERGED


def test_it_says_so_when_the_corrections_are_used_up() -> None:
    # The truth answers a third of what the belief moves: each correction closes a third of the gap.
    descent, found, course, _ = walk(TARGETS, truth_of(lambda v: 0.08 + v / 3.0), corrections=1)
    assert found is not None and len(course.rounds) == 2
    assert descent.reason is StopReason.NOT_CONFIRMED and not descent.reason.met


def test_a_correction_that_makes_it_worse_is_undone() -> None:
    descent, found, course, _ = walk(TARGETS, truth_of(lambda v: 0.11 if v >= 0.1 else 0.3))
    assert [round(r.miss, 6) for r in course.rounds] == [0.1, 2.0]
    assert found is not None and found.roughness == 0.11
    assert descent.best.roughness == 0.1
    assert descent.reason is StopReason.NOT_CONFIRMED


def test_an_interrupted_descent_is_verified_but_not_corrected() -> None:
    descent, found, course, _ = walk(TARGETS, truth_of(lambda v: 2.0 * v), way=Stopped)
    assert descent.reason is StopReason.INTERRUPTED
    assert found is not None and len(course.rounds) == 1


def test_the_original_gives_the_first_aim() -> None:
    aim = first_aim(BOTH, believed=(0.04, 30.0), true=(0.05, 40.0))
    assert (aim.roughness, aim.contact_area_mm2) == pytest.approx((0.08, 37.5))
    assert first_aim(TARGETS, (0.04, 30.0), (0.05, 40.0)).contact_area_mm2 is None


def test_models_that_have_nothing_in_common_are_not_corrected_without_bounds() -> None:
    assert first_aim(TARGETS, (0.04, 1.0), (1e-9, 1.0)).roughness == pytest.approx(0.2)
    assert first_aim(TARGETS, (0.04, 1.0), (0.0, 1.0)) == TARGETS
