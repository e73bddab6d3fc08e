"""Just-noticeable differences of roughness."""

import math

ROUGHNESS_JND = 1.19
"""Ratio of two roughnesses that a finger ranks correctly 84 % of the time (Tymms et al. 2018)."""
SMOOTH = 1e-6
"""Largest roughness that is rounding error; ratios to such a roughness mean nothing."""


def jnd_apart(roughness: float, reference: float) -> float:
    """Number of just-noticeable differences, positive if rougher than the reference, negative if smoother."""
    return math.log(roughness / reference) / math.log(ROUGHNESS_JND)


def jnd_unless_smooth(roughness: float, reference: float) -> float | None:
    """Number of just-noticeable differences, as `jnd_apart`; None if one of the two has no roughness."""
    return None if min(roughness, reference) < SMOOTH else jnd_apart(roughness, reference)


def jnd_scaled(reference: float, jnd: float) -> float:
    """Roughness that lies `jnd` just-noticeable differences above the reference."""
    return reference * ROUGHNESS_JND**jnd


def discrimination_probability(jnd: float) -> float:
    """Probability that a finger ranks two plates correctly: normal distribution function, 84 % at one JND.

    Args:
        jnd: just-noticeable differences between the plates, of either sign.
    """
    return 0.5 * (1.0 + math.erf(abs(jnd) / math.sqrt(2.0)))


def tries_of_100(jnd: float) -> int:
    """How often of 100 tries a person names the rougher of two plates rightly.

    Rounded down and at most 99, as 100 of 100 would claim certainty.

    Args:
        jnd: just-noticeable differences of roughness between the plates, of either sign.
    """
    return min(99, int(100.0 * discrimination_probability(jnd)))
