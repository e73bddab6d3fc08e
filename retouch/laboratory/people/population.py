"""What people have in common: the middle of a quantity over people who differ, with an interval.

The logarithm of the noise of people is normal about a middle mu with a spread tau; side preferences are
normal about none, lapse rates exponential. The likelihood of mu is the product over people of what their
answers allow, summed over how people differ, at the best tau, spread of preferences and mean lapse rate. An
interval holds all values whose likelihood is at least exp(-1.92) of the greatest (chi-squared, 95 %), or a
little less for few people. That it holds the truth as often as it says is simulated in
docs/evidence/people.md, where bootstraps do worse.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.interpolate import CubicSpline

from relief.ground.arrays import Array
from retouch.laboratory.people.likelihood import (
    LAPSE_RATES,
    NEVER,
    LikelihoodGrid,
    PairAnswers,
    PersonLikelihood,
    log_likelihoods,
    summed,
)

DROP = 1.9207
"""By how much the logarithm of the likelihood falls to the ends of an interval: half the 95 % point of the
chi-squared distribution of one degree. Intervals of few people's middle take that of F with one degree and
the square of their number, by simulation: with chi-squared those of three people held the truth in 90.5 %."""
SPREADS = np.array([0.0, 0.08, 0.12, 0.17, 0.24, 0.33, 0.45, 0.6, 0.85])
"""Standard deviations over people of the logarithm of their noise that are tried: none to more than
twofold."""
FLAT = 0.05
"""By how much the logarithm of the likelihood falls at least from a likeliest value to an open end; below
that, no value is likelier than those beyond the end."""
FINE = 4001
"""Places at which a likelihood between the values of its grid is read."""


@dataclass(frozen=True)
class Estimate:
    """A value with its 95 % interval.

    Attributes:
        value: the likeliest; None where the answers allow every value beyond one end.
        low, high: ends of the interval; None where there is no such end.
    """

    value: float | None
    low: float | None
    high: float | None

    def mapped(self, function: Callable[[float], float]) -> "Estimate":
        """The estimate of an ascending function of the quantity."""
        ends = (self.value, self.low, self.high)
        return Estimate(*(None if end is None else function(end) for end in ends))


@dataclass(frozen=True)
class Fitted:
    """What answers say of those who gave them.

    Attributes:
        noise: logarithm of the noise s of a comparison.
        preference: side preference, JND: positive towards the first plate.
        lapses: lapse rate.
    """

    noise: Estimate
    preference: Estimate
    lapses: Estimate


@dataclass(frozen=True)
class Population:
    """What all people's answers say.

    Attributes:
        middle: of all people together.
        each: of each person, in their order, from the person's own answers; how people lapse and prefer a
            side is taken from all.
        log_likelihood: of all answers at the best values.
        of_people: (p,) of each person's answers there.
    """

    middle: Fitted
    each: tuple[Fitted, ...]
    log_likelihood: float
    of_people: Array


def fit(people: Sequence[PairAnswers], grid: LikelihoodGrid | None = None) -> Population:
    """Fit the answers of one or more people; see the module.

    Args:
        people: their answers.
        grid: of likelihoods; None: one for so many answers.
    """
    grid = grid or LikelihoodGrid.for_answers(max(len(one) for one in people))
    each = [summed(one, grid) for one in log_likelihoods(people, grid)]
    joint = _joint(np.array([one.of_noise for one in each]), grid.noise)
    total = joint.sum(axis=1)
    best = np.unravel_index(total.argmax(), total.shape)
    shared = total.max(axis=(0, 3))
    weights = np.exp(shared - shared.max())
    lapses, spreads = weights.sum(axis=1), weights.sum(axis=0)
    noise = total.max(axis=(0, 1, 2))
    preferences = np.array([_weighted(one.of_preference, lapses) for one in each])
    of_lapses = np.array([_weighted(one.of_lapses, spreads) for one in each])
    drop = max(DROP, 0.5 * float(stats.f.ppf(0.95, 1, len(people) ** 2))) if len(people) > 1 else DROP
    middle = Fitted(
        interval(grid.noise, noise, drop=drop),
        interval(grid.preference, _joint(preferences, grid.preference).sum(axis=1).max(axis=0), drop=drop),
        interval(LAPSE_RATES, _joint(of_lapses, grid.noise).sum(axis=1).max(axis=(0, 2)), lowest=True),
    )
    return Population(
        middle,
        tuple(_one(one, grid, weights) for one in each),
        float(total.max()),
        joint[(best[0], slice(None), *best[1:])],
    )


def _one(one: PersonLikelihood, grid: LikelihoodGrid, weights: Array) -> Fitted:
    """A person, with people's lapses and preferences (7, 7) by what all answers allow."""
    return Fitted(
        interval(grid.noise, _weighted(one.of_noise, weights)),
        interval(grid.preference, _weighted(one.of_preference, weights.sum(axis=1))),
        interval(LAPSE_RATES, _weighted(one.of_lapses, weights.sum(axis=0)).max(axis=1), lowest=True),
    )


def _weighted(logs: Array, weights: Array) -> Array:
    """Logarithm of the weighted sum over the leading axes of likelihoods, which are those of the weights."""
    most = logs.max()
    return np.asarray(most + np.log(np.tensordot(weights, np.exp(logs - most), weights.ndim) + NEVER))


def _joint(logs: Array, values: Array) -> Array:
    """Logarithms (spreads, p, ..., t) of the likelihood of each person by the middle and spread of all.

    Args:
        logs: (p, ..., t) of each person's likelihood by a quantity.
        values: (t,) of the quantity, evenly spaced.

    Returns:
        For one person only the first spread, 0: one says nothing of how people differ.
    """
    most = logs.max(axis=-1, keepdims=True)
    likelihood = np.exp(logs - most)
    spreads = SPREADS if len(logs) > 1 else SPREADS[:1]
    joint = []
    for spread in spreads:
        if spread == 0.0:
            joint.append(logs)
            continue
        kernel = np.exp(-0.5 * np.square((values[:, None] - values) / spread))
        kernel /= kernel.sum(axis=1, keepdims=True)
        joint.append(most + np.log(likelihood @ kernel.T + NEVER))
    return np.array(joint)


def interval(values: Array, logs: Array, lowest: bool = False, drop: float = DROP) -> Estimate:
    """The likeliest value and all values that are likely enough.

    Args:
        values: (t,) ascending.
        logs: (t,) logarithms of their likelihood.
        lowest: whether the quantity begins at the first value, which is then no open end.
        drop: by how much the logarithm falls to the ends.
    """
    fine = np.linspace(values[0], values[-1], FINE)
    curve = CubicSpline(values, logs)(fine) if not lowest else np.interp(fine, values, logs)
    best = int(curve.argmax())
    out = curve < curve[best] - drop
    below, above = np.flatnonzero(out[:best]), np.flatnonzero(out[best:])
    low = float(fine[below[-1] + 1]) if len(below) else None
    high = float(fine[best + above[0] - 1]) if len(above) else None
    if low is None and lowest:
        low = float(values[0])
    endless = (low is None and curve[best] - curve[0] < FLAT) or (
        high is None and curve[best] - curve[-1] < FLAT
    )
    return Estimate(None if endless else float(fine[best]), low, high)


def weber(noise: Estimate) -> Estimate:
    """The Weber fraction of a noise's logarithm: the share of V at which 84 of 100 pairs are right."""
    return noise.mapped(lambda log: math.expm1(math.exp(log)))
