"""Numbers read as a person would write them."""

from __future__ import annotations

import pytest

from relief.ground.formatting import between, duration, number, plus_minus, rounded


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.07, "0.0700"),
        (12.0, "12.0"),
        (51.2, "51.2"),
        (-2.5, "\N{MINUS SIGN}2.50"),
        (0.0, "0.00"),
        (None, "\N{EN DASH}"),
        (float("nan"), "\N{EN DASH}"),
        (1e-7, "1e\N{MINUS SIGN}07"),
        (999.7, "1000"),
        (1234.5, "1230"),
        (-156250.0, "\N{MINUS SIGN}156000"),
        (2.5e6, "2.5e+06"),
    ],
)
def test_numbers_have_three_digits(value: float | None, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("length", "text"), [(56.83, "57"), (106.4, "106"), (99.6, "100"), (2.345, "2.3"), (1234.5, "1234")]
)
def test_lengths_are_whole_from_ten_on(length: float, text: str) -> None:
    assert rounded(length) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.5, "0.50 s"), (31.0, "31 s"), (99.6, "1 min 40 s"), (252.0, "4 min 12 s"), (7500.0, "2 h 5 min")],
)
def test_durations_read_as_spoken(seconds: float, text: str) -> None:
    assert duration(seconds) == text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (4.31684, 0.00529, "4.32"),
        (3.97514, 0.0001, "3.98"),
        (4.32282, 0.00977, "4.32 ± 0.01"),
        (2.3, 0.0123, "2.30 ± 0.01"),
        (-0.5, 0.2, "-0.5 ± 0.2"),
        (31.4, 3.0, "31 ± 3"),
        (1.0, 0.0, "1.00"),
        (1.0, float("nan"), "1.00"),
    ],
)
def test_a_value_has_the_digits_that_its_error_leaves(value: float, error: float, text: str) -> None:
    shown = plus_minus(value, error)
    assert shown == text.replace(" ", "\N{NO-BREAK SPACE}").replace("-", "\N{MINUS SIGN}")


@pytest.mark.parametrize(
    ("low", "high", "text"), [(2.22, 2.4, "2.2 to 2.4"), (2.41, 2.42, "2.4"), (0.0, 0.5, "0.0 to 0.50")]
)
def test_a_range_is_one_number_where_its_ends_read_alike(low: float, high: float, text: str) -> None:
    assert between(low, high) == f"{text}\N{NARROW NO-BREAK SPACE}%"
