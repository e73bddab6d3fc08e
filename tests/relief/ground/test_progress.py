"""Progress: stages tell whoever listens how far they are, and nothing to nobody."""

import math
from contextlib import AbstractContextManager

import pytest

from relief.ground import progress as stages
from relief.ground.progress import Progress, listening, progress, say, stage, this_stage


def followed() -> tuple[list[Progress], AbstractContextManager[None]]:
    """A list, and the context in which everything told is added to the list."""
    told: list[Progress] = []
    return told, progress(told.append)


def test_stages_tell_what_they_do_how_far_they_are_and_when_they_end(monkeypatch) -> None:
    monkeypatch.setattr(stages, "INTERVAL_S", 0.0)
    told, context = followed()
    with context, stage("outer", 4) as advance:
        advance()
        with stage("inner"):
            pass
        advance(2.0)
    assert [(one.stage, one.level, one.done, one.total, one.ended) for one in told] == [
        ("outer", 0, 0.0, 4, False),
        ("outer", 0, 1.0, 4, False),
        ("inner", 1, 0.0, None, False),
        ("inner", 1, 0.0, None, True),
        ("outer", 0, 3.0, 4, False),
        ("outer", 0, 3.0, 4, True),
    ]
    assert told[-1].fraction == 0.75


def test_a_stage_that_fails_has_ended() -> None:
    told, context = followed()
    with pytest.raises(KeyboardInterrupt), context, stage("work"):
        raise KeyboardInterrupt
    assert [one.ended for one in told] == [False, True]


def test_what_is_told_too_often_is_left_out_but_for_begin_end_and_lines(monkeypatch) -> None:
    monkeypatch.setattr(stages, "INTERVAL_S", math.inf)
    told, context = followed()
    with context, stage("work", 1000) as advance:
        for _ in range(1000):
            advance()
        advance.describe("step 1000")
        say("an interrupt")
    assert [(one.stage, one.done, one.detail) for one in told] == [
        ("work", 0.0, ""),
        ("work", 1000.0, "step 1000"),
        ("an interrupt", 0.0, ""),
        ("work", 1000.0, "step 1000"),
    ]


def test_nothing_is_told_where_nobody_listens() -> None:
    told, context = followed()
    with context, listening(None), stage("unheard", 2) as advance:
        advance()
        this_stage().describe("unheard")
        say("unheard")
    with stage("unheard"):
        this_stage().residual_at(10.0)
    assert told == []


def test_a_decorated_function_is_a_stage_of_its_own_each_time() -> None:
    @stage("squaring", total=1.0)
    def square(number: int) -> int:
        this_stage().reach(0.5)
        return number * number

    told, context = followed()
    with context:
        assert square(3) == 9 and square(4) == 16
    assert [(one.done, one.ended) for one in told] == [(0.0, False), (0.5, True)] * 2


def test_the_rest_takes_the_pace_so_far() -> None:
    assert Progress("work", done=1.0, total=4.0, seconds=2.0).remaining == 6.0
    assert Progress("work", done=0.0, total=4.0, seconds=2.0).remaining is None
    assert Progress("work", done=5.0, seconds=2.0).remaining is None
    steps = Progress("descending", done=5.0, total=20.0, seconds=10.0, at_most=True)
    assert (steps.fraction, steps.remaining) == (None, 30.0)
    assert Progress("nothing to do", total=0.0).fraction == 1.0


def test_a_residual_counts_by_its_digits_and_never_goes_back(monkeypatch) -> None:
    monkeypatch.setattr(stages, "INTERVAL_S", 0.0)
    told, context = followed()
    with context, stage("solving", total=1.0) as solving:
        for over in (1e6, 1e3, 1e5, 10.0, 0.5):
            solving.residual_at(over)
    assert [one.done for one in told[:-1]] == pytest.approx([0.0, 0.5, 5.0 / 6.0, 1.0])


def test_a_residual_that_is_no_number_says_nothing() -> None:
    told, context = followed()
    with context, stage("solving", total=1.0) as solving:
        for over in (math.inf, math.nan, 1.0):
            solving.residual_at(over)
    assert told[-1].done == 0.0
