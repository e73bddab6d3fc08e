"""Just-noticeable differences of roughness."""

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from relief.ground.arrays import Array

ROUGHNESS_JND = 1.19
"""Ratio of two roughnesses that a finger ranks correctly 84 % of the time (Tymms et al. 2018)."""
SMOOTH_BELOW = 0.004
"""Least roughness that published subjects judged, where Weber's law ends for want of evidence.

V of the finest texture of Drewing (2016, Low-amplitude textures explored with the bare finger), sine waves
0.3 mm high with a half period of 0.25 mm, is 0.0046 by the default finger; square waves have 0.0048, and dots
0.35 mm high and 6.2 mm apart 0.0088 (`benchmarks/results/published.json`)."""


def jnd_apart(roughness: float, reference: float) -> float:
    """Number of just-noticeable differences, positive if rougher than the reference, negative if smoother.

    NaN if one of the two is below `SMOOTH_BELOW`: a ratio of nearly smooth surfaces is no number of
    just-noticeable differences.
    """
    smooth = min(roughness, reference) < SMOOTH_BELOW
    return math.nan if smooth else math.log(roughness / reference) / math.log(ROUGHNESS_JND)


def jnds_apart(values: "Array", reference: "Array") -> "Array":
    """(k,) just-noticeable differences, as `jnd_apart`; NaN where one of the two is smooth."""
    # Imported here: commands import this module for their help.
    import numpy as np

    return np.array([jnd_apart(*pair) for pair in zip(values, reference, strict=True)])


def jnd_unless_smooth(roughness: float, reference: float) -> float | None:
    """Number of just-noticeable differences, as `jnd_apart`; None if one of the two is smooth."""
    jnd = jnd_apart(roughness, reference)
    return None if math.isnan(jnd) else jnd


def smooth_clause(roughness: float) -> str:
    """Why a roughness below `SMOOTH_BELOW` counts no just-noticeable differences, in a clause."""
    least = f"{SMOOTH_BELOW:g}, the least that people have judged"
    return f"smooth: V {roughness:.5f} is below {least}"


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
