"""How many people and trials a JND of a given precision takes, from the plan alone.

A person's answers know the logarithm of the noise s with the standard error that their Fisher information
gives, at the predicted JND; over people who differ by `SPREAD`, the middle of all is known with

    variance = (SPREAD² + standard error²) / people
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from relief.ground.arrays import Array

PRECISION = 0.1
"""Half of the 95 % interval that is asked for, as a share of the Weber fraction."""
SPREAD = 0.25
"""Standard deviation of people's logarithms of s that is assumed; 0.25 has two people in three within a
quarter of the middle either way. The people of an experiment say their own."""
LAPSES = 0.02
"""Lapse rate that is assumed."""
TRIALS = (20, 40, 80, 120, 240, 480)
"""Trials of a person for which the people are counted."""
LEAST_INFORMATION = 1e-6
"""Information of an answer, from which rounding is far: pairs of one difference alone have none."""
SIGMAS = float(stats.norm.ppf(0.975))


def information(differences: Array, noise: float) -> float:
    """Fisher information of one answer about log s, mean over pairs, less what lapses and preference take.

    Args:
        differences: (n,) logarithms of the ratios of the pairs' values.
        noise: s.
    """
    z = differences / noise
    density = stats.norm.pdf(z) * (1.0 - LAPSES)
    probability = 0.5 * LAPSES + (1.0 - LAPSES) * stats.norm.cdf(z)
    gradient = np.array([-density * z, -density, 0.5 - stats.norm.cdf(z)])
    matrix = (gradient / (probability * (1.0 - probability))) @ gradient.T / len(differences)
    return float(matrix[0, 0] - matrix[0, 1:] @ np.linalg.pinv(matrix[1:, 1:]) @ matrix[1:, 0])


def half_width(information_of_one: float, noise: float, people: int, trials: int, spread: float) -> float:
    """Half of the 95 % interval of the Weber fraction, as a share of the fraction, for all people."""
    variance = (spread**2 + 1.0 / (information_of_one * trials)) / people
    return SIGMAS * math.sqrt(variance) * noise * math.exp(noise) / math.expm1(noise)


@dataclass(frozen=True)
class PeopleNeeded:
    """How many people a precision takes, by trials each."""

    trials_each: int
    people: int


@dataclass(frozen=True)
class Power:
    """What a plan can say of the JND, before anybody has answered.

    Attributes:
        people, trials_each: of the plan.
        half_width_percent, half_width_of_a_person_percent: half of the interval in % of the Weber fraction,
            of all people and of one person.
        people_for_10_percent: of people who differ by `spread_assumed`.
    """

    people: int
    trials_each: int
    half_width_percent: float
    half_width_of_a_person_percent: float
    people_for_10_percent: tuple[PeopleNeeded, ...]
    spread_assumed: float


def power(differences: Sequence[float], ratio: float, people: int) -> Power | None:
    """What a plan can say of the JND; None if it cannot tell the JND from lapses and a preference.

    Args:
        differences: logarithms of the ratios of the values of all planned pairs.
        ratio: of values one JND apart, as predicted.
        people: of the plan.
    """
    noise = math.log(ratio)
    of_one = information(np.array(differences), noise)
    if of_one < LEAST_INFORMATION:
        return None
    trials = round(len(differences) / people)
    factor = (SIGMAS * noise * math.exp(noise) / math.expm1(noise) / PRECISION) ** 2
    return Power(
        people=people,
        trials_each=trials,
        half_width_percent=100.0 * half_width(of_one, noise, people, trials, SPREAD),
        half_width_of_a_person_percent=100.0 * half_width(of_one, noise, 1, trials, 0.0),
        people_for_10_percent=tuple(
            PeopleNeeded(each, math.ceil(factor * (SPREAD**2 + 1.0 / (of_one * each)))) for each in TRIALS
        ),
        spread_assumed=SPREAD,
    )
