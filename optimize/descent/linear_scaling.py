"""Linear scaling, the baseline: the relief scaled in height until its first target is met."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from optimize.descent.problem import Problem
from relief.arrays import Array
from relief.limits import HEIGHT_LIMIT_MM
from relief.progress import stage

STRIDE = 1.25
"""Factor between the scales tried, outward from 1, until the goal lies between two of them."""

FLATTEST = 0.02
"""Smallest scale tried."""


@stage("scaling the original for comparison")
def linear_scaling(problem: Problem) -> Array | None:
    """The original scaled in height until its first target is met (paper section 5.1.1).

    Returns:
        (rows, cols) mm, by the scale nearest to 1; None where no scale up to 3 mm meets the target.
    """
    relief = problem.heights - problem.heights.min()
    if relief.max() <= 0.0:
        return None

    target = problem.targets.each[0]

    def excess(scale: float) -> float:
        touch = problem.press(relief * scale, gradients=False)
        return touch.values[target.quantity.name] / target.goal - 1.0

    bracket = _bracket(excess, HEIGHT_LIMIT_MM / float(relief.max()))
    if bracket is None:
        return None
    # A tenth of the tolerance in the target is about as much in the scale.
    return np.asarray(relief * brentq(excess, *bracket, rtol=0.1 * target.tolerance))


def _bracket(excess: Callable[[float], float], highest: float) -> tuple[float, float] | None:
    """Two scales between which the excess changes sign, searched outward from 1 on both sides at once."""
    own = min(1.0, highest)
    at_own = excess(own)
    ends = dict.fromkeys((1, -1), (own, at_own))
    while ends:
        for side, (scale, value) in list(ends.items()):
            following = min(scale * STRIDE, highest) if side > 0 else scale / STRIDE
            if not FLATTEST <= following <= highest or following == scale:
                del ends[side]
                continue
            there = excess(following)
            if value * there <= 0.0:
                return min(scale, following), max(scale, following)
            ends[side] = (following, there)
    return None
