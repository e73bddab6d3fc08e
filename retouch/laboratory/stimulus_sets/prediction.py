"""Rankings of a set of plates by people, predicted from how the plates feel (Thurstone 1927, case V).

A plate of roughness V is felt at log V / log 1.19 just-noticeable differences (JND) plus normal noise of
standard deviation sqrt(1/2), so that the difference of two plates has standard deviation 1: a pair one JND
apart is ranked rightly with the probability Phi(1) = 84 %, by which Tymms et al. (2018) define the JND.
Coldness takes 40 % of contact area for one JND in the same way (Tiest and Kappers 2009; section 5.5.1 of the
paper).
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from relief.ground.arrays import Array

CONTACT_JND = 1.4
"""Ratio of two contact areas that is one just-noticeable difference of coldness."""
NOISE_JND = math.sqrt(0.5)
"""Standard deviation of the noise of one plate, JND."""
GRID_STEP_JND, GRID_REACH_JND = 0.01, 6.0
"""Grid of the integrals of `sorted_right`: step, and reach beyond the outermost plates; 8 noises."""
SORTS, SEED = 20_000, 0
"""Simulated sorts of `far_discrepancy`, and the seed of their noise."""


def probability(jnd: float) -> float:
    """Probability that the first of two plates is judged above the second.

    Args:
        jnd: by which the first lies above the second; negative if below.
    """
    return 0.5 * (1.0 + math.erf(jnd / math.sqrt(2.0)))


def cold_jnd(area: float, other: float) -> float:
    """Just-noticeable differences of coldness by which a contact area lies above another."""
    return math.log(area / other) / math.log(CONTACT_JND)


def judged_above(jnds: Sequence[float]) -> Array:
    """Probabilities (n, n) that the plate of the row is judged above that of the column; the diagonal is 1/2.

    Args:
        jnds: where the n plates are felt, JND.
    """
    return np.array([[probability(one - other) for other in jnds] for one in jnds])


def neighbours_right(jnds: Sequence[float]) -> float:
    """Mean probability that neighbours of two or more plates, in the order designed, are ranked rightly."""
    each = [probability(upper - lower) for lower, upper in pairwise(jnds)]
    return sum(each) / len(each)


def sorted_right(jnds: Sequence[float]) -> float:
    """Probability that a whole set is sorted as designed.

    The noises of the plates are independent, so that the probability is a chain of integrals over one
    variable each: F_k(x) is that the first k plates are in order and the last of them is felt below x.

    Args:
        jnds: where the plates are felt, JND, in the order designed.
    """
    grid = np.arange(min(jnds) - GRID_REACH_JND, max(jnds) + GRID_REACH_JND, GRID_STEP_JND)
    below = np.ones(len(grid))
    for jnd in jnds:
        density = np.exp(-0.5 * ((grid - jnd) / NOISE_JND) ** 2) / (NOISE_JND * math.sqrt(2.0 * math.pi))
        mass = density * below
        # Trapezoids; the density vanishes at the ends.
        below = GRID_STEP_JND * (np.cumsum(mass) - 0.5 * mass)
    return float(below[-1])


def far_discrepancy(jnds: Sequence[float]) -> float:
    """Share of sorts that have a pair of plates two or more steps apart the wrong way round.

    Args:
        jnds: where the plates are felt, JND, in the order designed.
    """
    felt = np.array(jnds) + np.random.default_rng(SEED).normal(0.0, NOISE_JND, (SORTS, len(jnds)))
    wrong = np.zeros(SORTS, dtype=bool)
    for one in range(len(jnds)):
        wrong |= (felt[:, one, None] > felt[:, one + 2 :]).any(axis=1)
    return float(wrong.mean())


def named(jnds: Sequence[float]) -> Array:
    """Probabilities (n, n) that a plate that is felt alone, of the row, is taken for that of the column.

    What is felt is taken for the nearest plate, from a perfect memory of all of them: people do worse.

    Args:
        jnds: where the n plates are felt, JND, ascending.
    """
    criteria = [-math.inf, *((lower + upper) / 2.0 for lower, upper in pairwise(jnds)), math.inf]
    return np.diff([[probability((end - jnd) / NOISE_JND) for end in criteria] for jnd in jnds])
