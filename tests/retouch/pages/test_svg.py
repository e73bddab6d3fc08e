"""Axes are round, limits are safe, charts survive what a run may hold."""

from __future__ import annotations

import base64

import numpy as np
import pytest

from retouch.pages.svg import (
    Band,
    Dot,
    Profile,
    Series,
    dot_chart,
    line_chart,
    nice_axis,
    round_up,
)

NAN = float("nan")


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 1.0), (0.043, 0.0707), (-0.31, 0.12), (0.0, 12.0), (2.0, 2.0)]
)
def test_axes_cover_their_range_with_few_round_ticks(low: float, high: float) -> None:
    axis = nice_axis(low, high)
    assert axis.low <= low
    assert high <= axis.high
    assert 3 <= len(axis.ticks) <= 9
    assert len({axis.label(tick) for tick in axis.ticks}) == len(axis.ticks)


def test_ticks_carry_as_many_decimals_as_their_step_needs() -> None:
    axis = nice_axis(0.0, 1.0, 2, tight=True)
    assert [axis.label(tick) for tick in axis.ticks] == ["0.0", "0.5", "1.0"]
    assert nice_axis(-80.0, 80.0).label(-40.0) == "\N{MINUS SIGN}40"


def test_limits_are_rounded_up_never_down() -> None:
    values = np.geomspace(0.01, 500.0, 97)
    assert all(value * (1 - 1e-9) <= round_up(value) <= 2.0 * value for value in values)


def test_a_chart_of_nothing_finite_is_still_a_chart() -> None:
    chart = line_chart("Roughness", [Series("V", [0.0], [NAN], "after")], "step", Band("t", 0.9, 1.0, 1.1))
    assert "nan" not in chart
    assert "Roughness" in chart


def test_ticks_at_whole_numbers_have_no_decimals() -> None:
    dots = dot_chart([Dot("one", 2.0, "2", "after"), Dot("original", 0.0, "0", "before")], "JND")
    assert ">+2<" in dots and ".0<" not in dots


def test_words_in_charts_are_escaped() -> None:
    dots = dot_chart([Dot("<b>", 1.0, "<i>1</i>", "after"), Dot("original", 0.0, "0", "before")], "<u>")
    chart = line_chart("<b>", [Series("<i>", [0, 1], [0, 1], "after")], "<u>")
    for text in (dots, chart):
        assert "<b>" not in text
        assert "<u>" not in text
        assert "<i>" not in text


def test_heights_reach_the_page_in_micrometres() -> None:
    counts = np.frombuffer(
        base64.b64decode(Profile(np.array([[0.0, 1.2345, -0.5]]), 10.0).micrometres), dtype="<i2"
    )
    np.testing.assert_array_equal(counts, [0, 1234, -500])


def test_a_profile_runs_through_pixel_centres() -> None:
    assert Profile(np.array([[0.0, 1.0]]), size_mm=10.0).path(0, top_mm=1.5) == "M2.500 1.500L7.500 0.500"
