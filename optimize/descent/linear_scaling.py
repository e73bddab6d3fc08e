"""Linear scaling, the baseline: the relief scaled in height until its first target is met."""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch

from optimize.descent.problem import Problem
from relief.arrays import Array
from relief.limits import HEIGHT_LIMIT_MM
from relief.progress import stage

STRIDE = 1.25
"""Factor between the scales tried, outward from 1, until the goal lies between two of them."""

FLATTEST = 0.02
"""Smallest scale tried."""

TRIES = 20
"""Most presses between two scales; two or three suffice, unless rounding exceeds the tolerance."""


@stage("scaling the original for comparison")
def linear_scaling(problem: Problem) -> Array | None:
    """The original scaled in height until its first target is met (paper section 5.1.1).

    The presses are in single precision, each from the pressures of the last; the target is met within a tenth
    of its tolerance.

    Returns:
        (rows, cols) mm, by the scale nearest to 1; None where no scale up to 3 mm meets the target.
    """
    relief = problem.heights - problem.heights.min()
    if relief.max() <= 0.0:
        return None

    target = problem.targets.each[0]
    single = replace(problem, precision=torch.float32)
    pressure = None

    def excess(scale: float) -> float:
        nonlocal pressure
        touch = single.press(relief * scale, pressure, gradients=False)
        pressure = touch.pressure
        return touch.values[target.quantity.name] / target.goal - 1.0

    bracket = _bracket(excess, HEIGHT_LIMIT_MM / float(relief.max()))
    if bracket is None:
        return None
    return np.asarray(relief * _root(excess, *bracket, 0.1 * target.tolerance))


_Point = tuple[float, float]
"""A scale and the excess there."""


def _bracket(excess: Callable[[float], float], highest: float) -> tuple[_Point, _Point] | None:
    """Two scales between which the excess changes sign, searched outward from 1 on both sides at once."""
    own = min(1.0, highest)
    ends = dict.fromkeys((1, -1), (own, excess(own)))
    while ends:
        for side, (scale, value) in list(ends.items()):
            following = min(scale * STRIDE, highest) if side > 0 else scale / STRIDE
            if not FLATTEST <= following <= highest or following == scale:
                del ends[side]
                continue
            there = excess(following)
            if value * there <= 0.0:
                return (scale, value), (following, there)
            ends[side] = (following, there)
    return None


def _root(excess: Callable[[float], float], one: _Point, other: _Point, tolerance: float) -> float:
    """The scale between two points of opposite excess where the excess is at most `tolerance`.

    False position over the logarithm of the scale, the end that stays halved (the Illinois rule).
    """
    (stays, weight), (scale, value) = (math.log(one[0]), one[1]), (math.log(other[0]), other[1])
    best = min((one, other), key=lambda point: abs(point[1]))
    for _ in range(TRIES):
        if abs(best[1]) <= tolerance:
            break
        middle = (stays * value - scale * weight) / (value - weight)
        there = excess(math.exp(middle))
        if there * value < 0.0:
            stays, weight = scale, value
        else:
            weight *= 0.5
        scale, value = middle, there
        best = min(best, (math.exp(middle), there), key=lambda point: abs(point[1]))
    return best[0]
