"""Numbers read as a person would write them."""

from __future__ import annotations

import pytest

from optimize.words import duration, number


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
    ],
)
def test_numbers_have_three_digits(value: float | None, text: str) -> None:
    assert number(value) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.5, "0.50 s"), (31.0, "31 s"), (99.6, "1 min 40 s"), (252.0, "4 min 12 s"), (7500.0, "2 h 5 min")],
)
def test_durations_read_as_spoken(seconds: float, text: str) -> None:
    assert duration(seconds) == text
