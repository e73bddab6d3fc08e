"""Just-noticeable differences."""

import pytest

from tactile import discrimination_probability, jnd_apart, jnd_scaled


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
