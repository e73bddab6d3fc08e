"""How likely a person's answers to pairs are, by just-noticeable difference, side preference and lapses.

Of two plates that differ by x, the logarithm of the ratio of their values V, a person ranks the second above
the first with the probability

    P(x) = g/2 + (1 - g) Phi(x / s - b)

Phi is the normal distribution function, s the noise of a comparison, g the lapse rate: in lapses a person
guesses, so that the guess rate is g/2 at either end. b is the side preference in units of s; the point of
equality lies at x = b s. Without lapses and preference Phi(1) = 84 of 100 pairs are right at x = s. The
Weber fraction exp(s) - 1 is therefore one just-noticeable difference (JND), 0.19 in `tactile.jnd`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from relief.ground.arrays import Array

NOISE_RANGE = (0.005, 8.0)
"""Least and greatest noise s of a comparison: Weber fractions from 0.5 % to 3000-fold, beyond any
person's."""
PREFERENCE_RANGE = 3.0
"""Largest side preference, JND either way: 99.9 % of equal plates ranked one way."""
LAPSE_RATES = np.array([0.0, 0.005, 0.01, 0.02, 0.03, 0.045, 0.06, 0.08, 0.1, 0.13, 0.16, 0.2, 0.25])
"""Lapse rates of a person, closer together where most people's are; 0.25 errs in an eighth of easy pairs."""
SPREAD_PREFERENCES = np.array([0.0, 0.1, 0.2, 0.35, 0.5, 0.75, 1.1])
"""Standard deviations of people's side preferences about none, JND."""
MEAN_LAPSES = np.array([0.0, 0.005, 0.01, 0.02, 0.04, 0.08, 0.15])
"""Mean lapse rates of people, whose own rates fall off exponentially about the mean."""
STEPS = {"noise": (0.03, 0.0625), "preference": (0.05, 0.125)}
"""Least and greatest step of the grids. A posterior's standard deviation is about 1.2 over the root of the
number of answers; sums over grids with steps up to it are exact to a few per mille."""
CERTAIN = 1e-12
"""Least probability of an answer, so that one slip never rules a value out."""
CHUNK = 16
"""Differences x whose probabilities are held at once, which bounds the memory: 30 MB on the usual grid."""
NEVER = 1e-300
"""Probability that counts as impossible without an infinite logarithm."""


@dataclass(frozen=True)
class LikelihoodGrid:
    """Values of noise, side preference and lapse rate whose likelihoods are computed.

    Attributes:
        noise: (t,) logarithms of s, ascending.
        preference: (b,) side preferences, JND, ascending about 0.
    """

    noise: Array
    preference: Array

    @classmethod
    def for_answers(cls, most: int) -> "LikelihoodGrid":
        """The grid for people of at most so many answers each."""
        width = 1.2 / math.sqrt(max(most, 1))
        noise, preference = (float(np.clip(width, *STEPS[name])) for name in ("noise", "preference"))
        low, high = np.log(NOISE_RANGE)
        half = math.ceil(PREFERENCE_RANGE / preference)
        return cls(
            np.linspace(low, high, math.ceil((high - low) / noise) + 1),
            np.linspace(-PREFERENCE_RANGE, PREFERENCE_RANGE, 2 * half + 1),
        )

    @cached_property
    def preference_weights(self) -> Array:
        """(7, b) weights of preferences for each of `SPREAD_PREFERENCES`, of sum 1."""
        spread = np.maximum(SPREAD_PREFERENCES, 1e-3)[:, None]
        weights = np.exp(-0.5 * np.square(self.preference / spread))
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))

    @cached_property
    def lapse_weights(self) -> Array:
        """(7, 13) weights of lapse rates for each of `MEAN_LAPSES`, of sum 1."""
        mean = np.maximum(MEAN_LAPSES, 1e-5)[:, None]
        weights = np.gradient(LAPSE_RATES) * np.exp(-LAPSE_RATES / mean)
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))


@dataclass(frozen=True)
class PairAnswers:
    """Answers of one person to pairs.

    Attributes:
        differences: (n,) logarithms of the ratios of the second plate's value to the first's.
        second: (n,) whether the second plate was ranked above the first.
    """

    differences: Array
    second: NDArray[np.bool_] = field(repr=False)

    def __len__(self) -> int:
        return len(self.differences)


@dataclass(frozen=True)
class PersonLikelihood:
    """Logarithms of the likelihood of a person's answers.

    Attributes:
        of_noise: (7, 7, t) by mean lapse rate and spread of preferences of people, and noise.
        of_preference: (7, b) by mean lapse rate of people, and preference, summed over noise.
        of_lapses: (7, 13, t) by spread of preferences of people, the person's lapse rate, and noise.
    """

    of_noise: Array
    of_preference: Array
    of_lapses: Array


def log_likelihoods(people: Sequence[PairAnswers], grid: LikelihoodGrid) -> Array:
    """(p, lapses, t, b) logarithms of the likelihood of each person's answers."""
    xs, counts, seconds = _counted(people)
    cells = (len(LAPSE_RATES), len(grid.noise), len(grid.preference))
    logs = np.zeros((len(people), math.prod(cells)))
    for start in range(0, len(xs), CHUNK):
        some = slice(start, start + CHUNK)
        z = xs[some] / np.exp(grid.noise)[:, None, None] - grid.preference[:, None]
        shares = LAPSE_RATES[:, None, None, None] / 2.0 + (1.0 - LAPSE_RATES[:, None, None, None]) * ndtr(z)
        shares = np.clip(shares, CERTAIN, 1.0 - CERTAIN).reshape(-1, z.shape[-1])
        logs += seconds[:, some] @ np.log(shares).T + (counts - seconds)[:, some] @ np.log1p(-shares).T
    return logs.reshape(len(people), *cells)


def _counted(people: Sequence[PairAnswers]) -> tuple[Array, Array, Array]:
    """Differences (x,), how often each person had them, and ranked the second above, (people, x)."""
    xs, places = np.unique(
        np.round(np.concatenate([one.differences for one in people]), 9), return_inverse=True
    )
    ends = np.cumsum([len(one) for one in people])[:-1]
    split = np.split(places, ends)
    counts = np.array([np.bincount(each, minlength=len(xs)) for each in split], dtype=float)
    seconds = np.array(
        [np.bincount(each, one.second, len(xs)) for each, one in zip(split, people, strict=True)]
    )
    return xs, counts, seconds


def summed(logs: Array, grid: LikelihoodGrid) -> PersonLikelihood:
    """Sums over what each likelihood of a person leaves out, of logarithms (lapses, noise, preference)."""
    most = logs.max()
    likelihood = np.exp(logs - most)
    by_lapses = np.tensordot(grid.lapse_weights, likelihood, axes=1)
    return PersonLikelihood(
        of_noise=most + _log((by_lapses @ grid.preference_weights.T).transpose(0, 2, 1)),
        of_preference=most + _log(by_lapses.sum(axis=1)),
        of_lapses=most + _log((likelihood @ grid.preference_weights.T).transpose(2, 0, 1)),
    )


def _log(values: Array) -> Array:
    return np.asarray(np.log(values + NEVER))
