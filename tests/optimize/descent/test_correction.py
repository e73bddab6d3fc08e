"""The verification corrects the goals of the descent, and the descent goes on from its best relief."""

from collections.abc import Callable, Mapping

import numpy as np
import pytest

from optimize.descent.correction import (
    STEPS_AN_ITERATION,
    CorrectionState,
    Plan,
    Segment,
    descend_with_correction,
    first_surrogate_targets,
)
from optimize.descent.driver import ArraySchema, Iterate
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from optimize.verification.summarising import iteration_values
from tactile.measures import TouchMeasures
from tests.optimize.descent.one_touch import one_touch

Array = np.ndarray
TARGETS = Targets.of(0.01, roughness=0.1)
BOTH = Targets.of(0.01, roughness=0.1, contact_area_mm2=50.0)
NOTHING = np.zeros((2, 2))
FIRST_STEPS = 3


def touch(roughness: float, area: float) -> dict[str, Array]:
    return one_touch(roughness=roughness, contact_area_mm2=area)


def iterate(step: int, roughness: float, area: float) -> Iterate:
    """The heights of the first two pixels are the descent's roughness and contact area."""
    return Iterate(step, np.array([[roughness, area]]), touch(roughness, area), 0.5, 1.0, 1.0, {})


class Straight:
    """A method that reaches its goals in one step, by its own model."""

    patience: int | None = 1

    def __init__(self, targets: Targets) -> None:
        self.goals = targets.goals()

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        return {}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        return iterate(step, *heights[0])

    def advance(self, current: Iterate) -> Iterate:
        return iterate(current.step + 1, *(current.means | self.goals).values())

    def reason_to_stop(self, current: Iterate) -> None:
        return None


class Stopped(Straight):
    """A method that is interrupted after its first step."""

    def advance(self, current: Iterate) -> Iterate:
        if current.step > 0:
            raise KeyboardInterrupt
        return super().advance(current)


class Recorder:
    """Observer that keeps steps and states."""

    def __init__(self) -> None:
        self.steps: list[int] = []
        self.states: list[CorrectionState] = []
        self.verified = -1

    def step(self, current: Iterate, best: Iterate, seconds: float) -> None:
        self.steps.append(current.step)

    def verifying(self, best: Iterate) -> None:
        self.verified = best.step

    def corrected(self, state: CorrectionState, start: Iterate) -> None:
        self.states.append(state)


def verification(roughness: Callable[[float], float], area: Callable[[float], float] = float):
    """A verification by functions of the descent's own values."""

    def verify(heights: Array) -> TouchMeasures:
        v, a = heights[0]
        values = touch(roughness(v), area(a))
        return TouchMeasures("fem", 8, values, np.full(1, 0.5), NOTHING, NOTHING, np.zeros((0, 4)), 0.0)

    return verify


def descend(targets: Targets, verify, corrections: int = 3, method: type[Straight] = Straight):
    recorder = Recorder()

    def method_for(surrogate: Targets, steps: int) -> Straight:
        assert steps == FIRST_STEPS + (1 + len(recorder.states)) * STEPS_AN_ITERATION
        return method(surrogate)

    plan = Plan(targets, FIRST_STEPS, corrections, method_for, verify)
    segment = Segment(method(targets), iterate(0, 0.05, 60.0))
    return *descend_with_correction(plan, CorrectionState(targets), segment, recorder), recorder


def test_a_model_that_is_off_by_a_factor_is_corrected_once() -> None:
    descent, verified, state, _ = descend(TARGETS, verification(lambda v: 1.1 * v))
    goals = [iteration.surrogate_goals["roughness"] for iteration in state.iterations]
    assert goals == pytest.approx([0.1, 0.1 / 1.1])
    errors = [iteration.relative_error for iteration in state.iterations]
    assert errors == pytest.approx([0.1, 0.0], abs=1e-12)
    assert verified is not None and verified.means["roughness"] == pytest.approx(0.1)
    assert descent.reason is StopReason.CONVERGED


def test_roughness_and_contact_area_are_corrected_together() -> None:
    verify = verification(lambda v: 0.9 * v, lambda a: a + 4.0)
    descent, verified, state, _ = descend(BOTH, verify)
    assert verified is not None and BOTH.met(verified.values)
    assert 1 < len(state.iterations) <= 3 and descent.reason.met


def test_steps_are_numbered_on_and_corrections_reported() -> None:
    descent, _, state, recorder = descend(TARGETS, verification(lambda v: v + 0.02))
    assert recorder.steps == list(range(1, descent.last.step + 1))
    reported = [len(state.iterations) for state in recorder.states]
    assert reported == list(range(1, len(state.iterations)))


def test_a_confirmed_result_ends_it_at_once() -> None:
    _, _, state, recorder = descend(TARGETS, verification(lambda v: 1.005 * v))
    assert len(state.iterations) == 1 and recorder.states == []


def test_without_verification_the_descent_stands() -> None:
    descent, verified, state, _ = descend(TARGETS, None)
    assert verified is None and state.iterations == () and descent.reason is StopReason.CONVERGED


def test_it_says_so_when_the_corrections_are_used_up() -> None:
    # The verified value moves by a third of the descent's: each correction closes a third of the gap.
    descent, verified, state, _ = descend(TARGETS, verification(lambda v: 0.08 + v / 3.0), corrections=1)
    assert verified is not None and len(state.iterations) == 2
    assert descent.reason is StopReason.NOT_CONFIRMED and not descent.reason.met


def test_a_correction_that_makes_it_worse_is_undone() -> None:
    descent, verified, state, _ = descend(TARGETS, verification(lambda v: 0.11 if v >= 0.1 else 0.3))
    assert [round(iteration.relative_error, 6) for iteration in state.iterations] == [0.1, 2.0]
    assert verified is not None and verified.means["roughness"] == 0.11
    assert descent.best.means["roughness"] == 0.1
    assert descent.reason is StopReason.NOT_CONFIRMED


def test_an_interrupted_descent_is_verified_but_not_corrected() -> None:
    descent, verified, state, _ = descend(TARGETS, verification(lambda v: 2.0 * v), method=Stopped)
    assert descent.reason is StopReason.INTERRUPTED
    assert verified is not None and len(state.iterations) == 1


def test_an_interrupted_verification_leaves_the_descents_best() -> None:
    def interrupted(heights: Array) -> TouchMeasures:
        raise KeyboardInterrupt

    descent, verified, state, recorder = descend(TARGETS, interrupted)
    assert descent.reason is StopReason.INTERRUPTED and verified is None and state.iterations == ()
    assert TARGETS.met(descent.best.values) and recorder.verified == descent.best.step


def test_the_original_gives_the_first_surrogate_goals() -> None:
    steering, verified = touch(0.04, 30.0), touch(0.05, 40.0)
    surrogate = first_surrogate_targets(BOTH, steering, verified)
    assert surrogate.goals() == pytest.approx({"roughness": 0.08, "contact_area_mm2": 37.5})
    assert first_surrogate_targets(TARGETS, steering, verified).goals().keys() == {"roughness"}


def test_the_correction_factor_has_bounds() -> None:
    far = first_surrogate_targets(TARGETS, touch(0.04, 1.0), touch(1e-9, 1.0))
    assert far.goals()["roughness"] == pytest.approx(0.2)
    assert first_surrogate_targets(TARGETS, touch(0.04, 1.0), touch(0.0, 1.0)) == TARGETS


def test_an_outer_iteration_has_a_row_with_every_number() -> None:
    _, _, state, _ = descend(TARGETS, verification(lambda v: 1.005 * v))
    assert iteration_values(state.iterations[0]).as_json() == {
        "surrogate_target_roughness": 0.1,
        **{"roughness": 0.1, "verified_roughness": pytest.approx(0.1005)},
        "surrogate_target_contact_area_mm2": None,
        **{"contact_area_mm2": 60.0, "verified_contact_area_mm2": 60.0},
        "relative_error": pytest.approx(0.005),
        "steps": state.iterations[0].steps,
    }
