"""Just-noticeable differences are found again, and what answers cannot say is no number."""

import math

import numpy as np
import pytest
from scipy.special import ndtr

from relief.ground.arrays import Array
from retouch.laboratory.people.likelihood import LikelihoodGrid, PairAnswers, log_likelihoods
from retouch.laboratory.people.population import Estimate, fit, weber
from retouch.laboratory.people.power import half_width, information, power

JND = math.log(1.19)
PAIRS = np.array([(i - j) * JND for i in range(5) for j in range(5) if i != j])


def answered(
    rng: np.random.Generator, xs: Array, noise: float = JND, lapses: float = 0.02, preference: float = 0.0
) -> PairAnswers:
    told = 0.5 * lapses + (1.0 - lapses) * ndtr(xs / noise - preference)
    return PairAnswers(xs, rng.random(len(xs)) < told)


def holds(interval: Estimate, truth: float) -> bool:
    return (interval.low or -np.inf) <= truth <= (interval.high or np.inf)


def test_the_likelihood_is_that_of_the_formula(rng: np.random.Generator) -> None:
    person = answered(rng, np.tile(PAIRS, 2), preference=0.5)
    grid = LikelihoodGrid.for_answers(40)
    logs = log_likelihoods([person], grid)[0, 3, 50, 20]
    told = 0.01 + 0.98 * ndtr(person.differences / math.exp(grid.noise[50]) - grid.preference[20])
    assert logs == pytest.approx(np.log(np.where(person.second, told, 1.0 - told)).sum(), rel=1e-9)


def test_the_weber_fraction_is_where_84_of_100_pairs_are_told_right() -> None:
    fraction = weber(Estimate(math.log(JND), None, None)).value
    assert fraction == pytest.approx(0.19)
    assert ndtr(math.log1p(0.19) / JND) == pytest.approx(0.84, abs=0.002)


def test_intervals_hold_what_was_simulated(rng: np.random.Generator) -> None:
    """docs/evidence/people.md counts thirteen kinds of experiments; here are a few of one."""
    middle, person, equality = [], [], []
    for _ in range(20):
        preferences = 0.4 * rng.standard_normal(4)
        fitted = fit([answered(rng, np.tile(PAIRS, 4), preference=one) for one in preferences])
        middle.append(holds(fitted.middle.noise, math.log(JND)))
        person += [holds(one.noise, math.log(JND)) for one in fitted.each]
        equality += [holds(one.preference, each) for one, each in zip(fitted.each, preferences, strict=True)]
    assert sum(middle) >= 17
    assert sum(person) >= 70 and sum(equality) >= 70


def test_the_interval_of_two_people_who_differ_holds_what_is_true_of_all(rng: np.random.Generator) -> None:
    """Two people say little of how far others differ: their interval is wider than that of many would be."""
    grid = LikelihoodGrid(math.log(JND) + np.linspace(-1.2, 1.2, 41), np.linspace(-0.6, 0.6, 7))
    held = 0
    for _ in range(100):
        noises = JND * np.exp(0.25 * rng.standard_normal(2))
        fitted = fit([answered(rng, np.tile(PAIRS, 12), noise) for noise in noises], grid)
        held += holds(fitted.middle.noise, math.log(JND))
    assert held >= 95


def test_who_makes_no_error_has_a_bound_and_no_jnd() -> None:
    perfect = PairAnswers(np.tile(PAIRS, 3), np.tile(PAIRS, 3) > 0.0)
    one = fit([perfect]).middle.noise
    assert one.value is None and one.low is None and one.high is not None
    assert weber(one).high == pytest.approx(0.12, abs=0.03)


def test_who_guesses_has_a_lower_bound(rng: np.random.Generator) -> None:
    guesses = PairAnswers(np.tile(PAIRS, 6), rng.random(120) < 0.5)
    one = fit([guesses]).middle.noise
    assert one.high is None and one.low is not None and (weber(one).low or 0.0) > 0.25


def test_more_answers_narrow_the_interval(rng: np.random.Generator) -> None:
    widths = []
    for repeats in (2, 8, 32):
        one = weber(fit([answered(rng, np.tile(PAIRS, repeats))]).middle.noise)
        assert one.high is not None
        widths.append(one.high - (one.low or 0.0))
    assert widths[0] > 1.5 * widths[1] > 2.0 * widths[2]


def test_the_plan_tells_the_width_beforehand(rng: np.random.Generator) -> None:
    planned = half_width(information(PAIRS, JND), JND, 4, 200, 0.0)
    found = []
    for _ in range(12):
        one = weber(fit([answered(rng, np.tile(PAIRS, 10)) for _ in range(4)]).middle.noise)
        assert one.high is not None and one.low is not None
        found.append(0.5 * (one.high - one.low) / 0.19)
    assert np.median(found) == pytest.approx(planned, rel=0.35)


def test_one_difference_does_not_tell_a_jnd_from_lapses() -> None:
    """Two levels in both orders give two shares of answers, for three unknowns."""
    step = math.log(1.19)
    assert power([step, -step] * 30, 1.19, people=2) is None
    assert power([step, -step, 2 * step, -2 * step] * 30, 1.19, people=2) is not None
