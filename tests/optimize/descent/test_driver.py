"""The descent loop keeps the best relief rather than the last, and says truly why it stopped."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from optimize.descent.driver import (
    HOPELESS_STEPS,
    ArraySchema,
    Iterate,
    StepRecord,
    StopReason,
    better,
    check_memory,
    descend,
    record_of,
)
from optimize.descent.targets import Targets
from relief.ground.errors import InputError
from tactile import ContactError
from tests.optimize.descent.one_touch import one_touch

Array = np.ndarray
TARGETS = Targets.of(0.01, roughness=0.1)
MET, NEAR, FAR = 0.1, 0.11, 0.2


def iterate(step: int, roughness: float, change: float) -> Iterate:
    """Heights tell the step, too."""
    return Iterate(
        step, np.full((2, 2), float(step)), one_touch(roughness=roughness), 0.5, change, change, {}
    )


class Scripted:
    """A method that visits given (roughness, picture change) one after the other, or is interrupted."""

    def __init__(self, visits: Sequence[tuple[float, float] | None], patience: int | None = 2) -> None:
        self.visits, self.patience = visits, patience

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        return {}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        return iterate(step, FAR, 0.0)

    def advance(self, current: Iterate) -> Iterate:
        visit = self.visits[current.step]
        if visit is None:
            raise KeyboardInterrupt
        return iterate(current.step + 1, *visit)

    def reason_to_stop(self, current: Iterate) -> StopReason | None:
        return None


BOUNDS = {"trust": ArraySchema((2,), 0.0, 1.0), "pressure": ArraySchema((2, 2), 0.0, np.inf)}
SOUND = {"trust": np.array([0.5, 1.0]), "pressure": np.zeros((2, 2))}


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("trust", np.zeros(3)),
        ("trust", np.array([0.5, 1.5])),
        ("pressure", -np.ones((2, 2))),
        ("x", np.ones(1)),
    ],
)
def test_a_memory_that_is_not_that_of_the_method_is_refused(name: str, value: Array) -> None:
    check_memory(SOUND, BOUNDS)
    with pytest.raises(InputError, match=rf"^memory\.{name}: "):
        check_memory({**SOUND, name: value}, BOUNDS)
    with pytest.raises(InputError, match=r"^memory\.trust: missing"):
        check_memory({"pressure": SOUND["pressure"]}, BOUNDS)


START = iterate(0, FAR, 0.0)


def test_it_keeps_the_best_not_the_last() -> None:
    method = Scripted([(MET, 5.0), (MET, 3.0), (MET, 4.0)])
    descent = descend(method, TARGETS, START, 3)
    assert (descent.best.step, descent.last.step) == (2, 3)


def test_it_converges_once_the_target_is_met_and_the_look_stands_still() -> None:
    method = Scripted([(NEAR, 4.0), (MET, 5.0), (MET, 5.0), (MET, 4.99), (MET, 1.0)])
    descent = descend(method, TARGETS, START, 5)
    assert (descent.reason, descent.last.step) == (StopReason.CONVERGED, 4)


class Bounded(Scripted):
    """A method with a stopping rule of its own: the picture change."""

    def reason_to_stop(self, current: Iterate) -> StopReason | None:
        return StopReason.WITHIN_BOUNDS if current.step > 0 and current.picture_rms < 3.0 else None


def test_it_stops_where_the_rule_of_the_method_holds() -> None:
    visits = [(NEAR, 4.0), (MET, 2.9), (MET, 1.0)]
    descent = descend(Bounded(visits, patience=None), TARGETS, START, 3)
    assert (descent.reason, descent.last.step, descent.best.step) == (StopReason.WITHIN_BOUNDS, 2, 2)
    assert descent.reason.met
    # Gone on from a step at which the rule holds already, no further step is made.
    again = descend(Bounded(visits, patience=None), TARGETS, descent.last, 3)
    assert (again.reason, again.last.step) == (StopReason.WITHIN_BOUNDS, 2)


def test_it_goes_on_while_the_look_improves() -> None:
    method = Scripted([(MET, 9.0 * 0.9**step) for step in range(10)])
    descent = descend(method, TARGETS, START, 10)
    assert (descent.reason, descent.best.step) == (StopReason.STEP_LIMIT, 10)


def test_it_converges_at_the_very_last_step_too() -> None:
    descent = descend(Scripted([(MET, 5.0)] * 3), TARGETS, START, 3)
    assert descent.reason is StopReason.CONVERGED


def test_a_method_with_a_schedule_converges_at_its_end() -> None:
    method = Scripted([(MET, 5.0)] * 8, patience=None)
    descent = descend(method, TARGETS, START, 8)
    assert (descent.reason, descent.last.step) == (StopReason.CONVERGED, 8)


@pytest.mark.parametrize("patience", [2, None])
def test_too_few_steps_are_short_of_the_target(patience: int | None) -> None:
    method = Scripted([(FAR - 0.02 * step, 5.0) for step in range(3)], patience)
    assert descend(method, TARGETS, START, 3).reason is StopReason.SHORT_OF_TARGET


def test_a_target_that_no_step_comes_closer_to_is_out_of_reach() -> None:
    method = Scripted([(NEAR, 5.0)] * 100)
    descent = descend(method, TARGETS, START, 100)
    assert (descent.reason, descent.last.step) == (StopReason.UNREACHABLE, HOPELESS_STEPS + 1)


def test_steps_that_miss_a_target_on_either_side_are_not_said_to_be_out_of_reach() -> None:
    method = Scripted([(side * MET, 5.0) for side in (0.9, 1.1)] * 50)
    descent = descend(method, TARGETS, START, 100)
    assert descent.reason is StopReason.SWINGING and not descent.reason.met
    assert "exact models" in descent.reason.value and "out of reach" not in descent.reason.value
    # One step beyond is no swing.
    method = Scripted([(1.1 * MET, 5.0)] + [(NEAR, 5.0)] * 99)
    assert descend(method, TARGETS, START, 100).reason is StopReason.UNREACHABLE


def test_a_target_met_once_is_within_reach_wherever_later_steps_go() -> None:
    method = Scripted([(NEAR, 5.0), (MET, 5.0), *[(NEAR, 5.0)] * 30])
    descent = descend(method, TARGETS, START, 32)
    assert (descent.reason, descent.best.step) == (StopReason.STEP_LIMIT, 2)


def test_slow_progress_is_not_out_of_reach() -> None:
    method = Scripted([(FAR * 0.99**step, 5.0) for step in range(60)])
    assert descend(method, TARGETS, START, 60).reason is StopReason.SHORT_OF_TARGET


@pytest.mark.parametrize("bad", [(float("nan"), 1.0), (MET, float("inf"))])
def test_a_value_that_is_not_finite_ends_it_before(bad: tuple[float, float]) -> None:
    descent = descend(Scripted([(NEAR, 5.0), bad]), TARGETS, START, 5)
    assert descent.reason is StopReason.NON_FINITE
    assert (descent.best.step, descent.last.step) == (1, 1)


def test_heights_that_are_not_finite_end_it_too() -> None:
    class Lost(Scripted):
        def advance(self, current: Iterate) -> Iterate:
            return replace(super().advance(current), heights=np.full((2, 2), np.nan))

    descent = descend(Lost([(MET, 1.0)]), TARGETS, START, 5)
    assert (descent.reason, descent.best.step) == (StopReason.NON_FINITE, 0)


def test_a_contact_that_does_not_converge_is_a_reason_to_stop() -> None:
    class Stuck(Scripted):
        def advance(self, current: Iterate) -> Iterate:
            if current.step == 2:
                raise ContactError("not converged")
            return super().advance(current)

    descent = descend(Stuck([(MET, 5.0), (NEAR, 4.0)]), TARGETS, START, 5)
    assert descent.reason is StopReason.CONTACT_FAILED and not descent.reason.met
    assert (descent.best.step, descent.last.step) == (1, 2)


@pytest.mark.parametrize("patience", [1, None])
def test_an_original_that_feels_as_wanted_takes_no_step(patience: int | None) -> None:
    start = iterate(0, MET, 0.0)
    descent = descend(Scripted([], patience), TARGETS, start, 100)
    assert descent.reason is StopReason.CONVERGED and descent.best is descent.last is start


def test_an_interrupted_step_leaves_what_was_there_before_it() -> None:
    descent = descend(Scripted([(MET, 5.0), (NEAR, 4.0), None]), TARGETS, START, 5)
    assert descent.reason is StopReason.INTERRUPTED
    assert (descent.best.step, descent.last.step) == (1, 2)


def test_no_step_left_means_no_step() -> None:
    descent = descend(Scripted([]), TARGETS, iterate(7, MET, 5.0), 7)
    assert (descent.reason, descent.last.step) == (StopReason.STEP_LIMIT, 7)


def test_the_callback_gets_every_step() -> None:
    seen: list[tuple[int, int]] = []
    method = Scripted([(NEAR, 5.0), (MET, 4.0), (FAR, 3.0)])
    descend(method, TARGETS, START, 3, on_step=lambda at, best, _: seen.append((at.step, best.step)))
    assert seen == [(1, 1), (2, 2), (3, 2)]


def test_the_best_of_an_earlier_segment_is_kept() -> None:
    earlier = iterate(3, MET, 1.0)
    descent = descend(Scripted([(MET, 2.0)] * 5), TARGETS, iterate(4, MET, 2.0), 5, best=earlier)
    assert descent.best is earlier


def trace_of(visits: Sequence[tuple[float, float]]) -> list[StepRecord]:
    return [record_of(TARGETS, one_touch(roughness=roughness), change) for roughness, change in visits]


@pytest.mark.parametrize("cut", [1, 3, 4])
@pytest.mark.parametrize("roughness", [MET, NEAR])
def test_a_descent_in_two_segments_ends_where_one_in_one_segment_does(cut: int, roughness: float) -> None:
    visits = [(FAR, 3.0), (NEAR, 4.0), *[(roughness, 5.0)] * 40]
    whole = descend(Scripted(visits), TARGETS, START, 40)
    first = descend(Scripted(visits), TARGETS, START, cut)
    second = descend(Scripted(visits), TARGETS, first.last, 40, first.best, trace=trace_of(visits[:cut]))
    assert (second.reason, second.last.step) == (whole.reason, whole.last.step)
    assert second.best.step == whole.best.step


@pytest.mark.parametrize(("roughness", "reason"), [(MET, "CONVERGED"), (NEAR, "UNREACHABLE")])
def test_a_finished_descent_takes_no_further_step(roughness: float, reason: str) -> None:
    visits = [(roughness, 5.0)] * 20
    first = descend(Scripted(visits), TARGETS, START, 20)
    trace = trace_of(visits[: first.last.step])
    again = descend(Scripted([]), TARGETS, first.last, 20, first.best, trace=trace)
    assert (again.reason, first.reason) == (StopReason[reason], StopReason[reason])
    assert (again.last, again.best) == (first.last, first.best)


def test_a_target_met_comes_before_a_look_kept() -> None:
    met, closer = iterate(1, MET, 9.0), iterate(2, NEAR, 1.0)
    assert better(TARGETS, met, closer) is met
    assert better(TARGETS, closer, met) is met


def test_of_two_that_meet_the_target_the_closer_look_is_better() -> None:
    one, other = iterate(1, 1.009 * MET, 2.0), iterate(2, MET, 3.0)
    assert better(TARGETS, one, other) is one
    assert better(TARGETS, other, one) is one


def test_of_two_that_miss_the_target_the_nearer_is_better_whatever_its_look() -> None:
    one, other = iterate(1, NEAR, 9.0), iterate(2, FAR, 0.0)
    assert better(TARGETS, one, other) is one
    assert better(TARGETS, other, one) is one


def test_what_other_fingers_feel_counts_like_a_change_of_the_pictures() -> None:
    near, far = (replace(iterate(1, MET, 3.0), fingers=fingers) for fingers in (4.0, 5.0))
    assert near.cost == pytest.approx(5.0)
    assert better(TARGETS, far, near) is near and better(TARGETS, near, far) is near
    assert better(TARGETS, near, iterate(2, MET, 5.1)) is near
    assert not replace(near, fingers=np.inf).finite()
