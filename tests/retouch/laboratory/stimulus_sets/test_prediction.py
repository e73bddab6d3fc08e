"""Predictions of what people tell: by the definition of the difference, against simulated sorts."""

import math

import numpy as np
import pytest

from retouch.laboratory.stimulus_sets.prediction import (
    NOISE_JND,
    cold_jnd,
    far_discrepancy,
    judged_above,
    neighbours_right,
    probability,
    sorted_right,
)
from tactile.jnd import discrimination_probability

LEVELS = [-2.1, -0.9, 0.0, 1.2, 1.9]


def test_one_difference_is_told_right_in_84_of_100() -> None:
    assert probability(1.0) == pytest.approx(0.8413, abs=1e-4) == discrimination_probability(1.0)
    assert probability(0.0) == 0.5 and probability(-1.0) == pytest.approx(1.0 - probability(1.0))
    assert neighbours_right([-2.0, -1.0, 0.0, 1.0, 2.0]) == pytest.approx(0.8413, abs=1e-4)
    assert cold_jnd(1.4, 1.0) == pytest.approx(1.0) and cold_jnd(1.0, 1.4**2) == pytest.approx(-2.0)


def test_the_matrix_has_a_probability_and_its_opposite() -> None:
    matrix = judged_above(LEVELS)
    assert matrix + matrix.T == pytest.approx(np.ones((5, 5))) and (np.diff(matrix, axis=0) > 0.0).all()
    assert matrix[3, 2] == probability(1.2)


def test_sorting_agrees_with_simulated_people() -> None:
    felt = np.array(LEVELS) + np.random.default_rng(3).normal(0.0, NOISE_JND, (200_000, 5))
    right = float((np.diff(felt, axis=1) > 0.0).all(axis=1).mean())
    error = math.sqrt(right * (1.0 - right) / len(felt))
    assert abs(sorted_right(LEVELS) - right) < 4.0 * error
    assert sorted_right([0.3, 1.0]) == pytest.approx(probability(0.7), abs=1e-4)
    assert sorted_right([1.0, 1.0, 1.0]) == pytest.approx(1.0 / 6.0, abs=1e-4)


def test_discrepancies_two_steps_apart_are_rare() -> None:
    assert far_discrepancy([0.0, 1.0]) == 0.0
    three = far_discrepancy([-1.0, 0.0, 1.0])
    assert three == pytest.approx(1.0 - probability(2.0), abs=0.005)
    assert three < far_discrepancy([-2.0, -1.0, 0.0, 1.0, 2.0]) < 3.5 * three
