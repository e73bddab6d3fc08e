"""Just-noticeable differences."""

import json
import math
from pathlib import Path

import pytest

from tactile import discrimination_probability, jnd_apart, jnd_scaled
from tactile.jnd import SMOOTH_BELOW, jnd_unless_smooth

ROOT = Path(__file__).parents[2]


def test_one_jnd_is_a_factor_of_1_19() -> None:
    assert jnd_apart(1.19 * 0.05, 0.05) == pytest.approx(1.0)
    assert jnd_scaled(0.05, 1.0) == pytest.approx(1.19 * 0.05)


def test_steps_add_up_and_turn_around() -> None:
    for jnd in (-3.0, -0.5, 0.0, 2.0):
        assert jnd_apart(jnd_scaled(0.05, jnd), 0.05) == pytest.approx(jnd)
        assert jnd_apart(0.05, jnd_scaled(0.05, jnd)) == pytest.approx(-jnd)


def test_plates_one_jnd_apart_are_told_apart_84_percent_of_the_time() -> None:
    assert discrimination_probability(1.0) == pytest.approx(0.84, abs=0.002)
    assert discrimination_probability(-1.0) == discrimination_probability(1.0)
    assert discrimination_probability(0.0) == 0.5
    assert discrimination_probability(3.0) > 0.998


def test_ratios_to_what_nobody_judged_are_no_just_noticeable_differences() -> None:
    board = json.loads((ROOT / "benchmarks/results/published.json").read_text())
    least = min(
        value
        for row in board["tables"][0]["rows"]
        if (row["labels"]["finding"], row["labels"]["finger"]) in (("waves", "paper"), ("ridges", "paper"))
        for column, value in board["records"][row["key"]]["columns"].items()
        if column.startswith("V ")
    )
    assert 0.85 * least < SMOOTH_BELOW < least
    assert jnd_unless_smooth(0.05, SMOOTH_BELOW) == pytest.approx(jnd_apart(0.05, SMOOTH_BELOW))
    for pair in ((0.05, 0.0039), (0.0039, 0.05), (3e-5, 2e-5), (0.0, 0.05)):
        assert math.isnan(jnd_apart(*pair)) and jnd_unless_smooth(*pair) is None
