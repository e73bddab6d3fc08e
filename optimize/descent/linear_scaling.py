"""Linear scaling, the method to compare with: the relief scaled until its first target is met (paper 5.1).

Of several places, the mean is to meet the mean of the goals: one scale cannot meet more.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Self

import numpy as np
import torch
from scipy import ndimage

from optimize.descent.driver import ArraySchema, Iterate
from optimize.descent.methods import MethodSettings
from optimize.descent.problem import Problem, change_percent
from optimize.descent.stop_reason import StopReason
from relief.ground.arrays import Array
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.ground.progress import stage
from tactile.measures import TouchMeasures

SAMPLES = 16
"""Samples a pixel of the pictures whose change is shown while a run scales."""
STRIDE, OVERSHOOT = 1.25, 1.02
"""Factor between the first scales tried, outward from 1; and distance of the next scale, in units of the
extrapolated distance of the goal (logarithms), until the goal lies between two scales."""

FLATTEST = 0.02
"""Smallest scale of the height tried."""

WIDEST = 4.0
"""Largest factor sideways that is tried, both ways: a quarter of the plate's side then fills the plate."""

TRIES = 20
"""Most presses between two scales; two or three suffice, unless rounding exceeds the tolerance."""

ACCURACY = 0.1
"""Share of the target's tolerance within which the target is met."""

_Point = tuple[float, float]
"""A scale and the excess there: the logarithm of the quantity over its goal, nearly linear in the scale's."""
LEAST_STRIDE = 1.01
"""Least factor between two scales."""
LEAST = 1e-9
"""Share of the goal that replaces smaller values: zero has no logarithm."""


@stage("scaling the original for comparison")
def linear_scaling(problem: Problem, original: TouchMeasures | None = None) -> Array | None:
    """The original scaled in height until its first target is met.

    The presses are in single precision, each from the pressures of the last; the target is met within a tenth
    of its tolerance.

    Args:
        problem: of the original.
        original: its touch by the model that steers; None: pressed here.

    Returns:
        (rows, cols) mm; None where no scale up to 3 mm meets the target. A relief higher than 3 mm is scaled
        as a whole, below what a finger reaches too, and only down.
    """
    relief = problem.heights - problem.heights.min()
    if relief.max() <= 0.0:
        return None
    excess = _excess_of(problem, original)
    (scale, _), met = _height_scale(excess, relief, ACCURACY * problem.targets.each[0].tolerance)
    return relief * scale if met else None


def scaled_both_ways(problem: Problem) -> Array:
    """The original scaled in height up to 3 mm and then, if that is not enough, sideways as well.

    A relief higher than 3 mm is not made higher.

    Returns:
        (rows, cols) mm: the first target is met within a tenth of its tolerance, or missed by the least of
        all scales tried.
    """
    relief = problem.heights - problem.heights.min()
    if relief.max() <= 0.0:
        return relief
    excess, tolerance = _excess_of(problem), ACCURACY * problem.targets.each[0].tolerance
    (scale, missed_by), met = _height_scale(excess, relief, tolerance)
    if met:
        return relief * scale
    tallest = relief * _highest_scale(relief)
    (factor, closest), _ = _scale_for(
        lambda factor: excess(stretched(tallest, factor)), 1.0, (1.0 / WIDEST, WIDEST), tolerance
    )
    return stretched(tallest, factor) if abs(closest) < abs(missed_by) else relief * scale


def stretched(relief: Array, factor: float) -> Array:
    """A relief scaled sideways about the centre of the plate; where it ends, it goes on as in a mirror.

    Args:
        relief: (rows, cols) heights.
        factor: above 1, the middle of the relief fills the plate; below 1, detail that the grid cannot hold
            is blurred.

    Returns:
        (rows, cols) in the range of `relief`, by cubic interpolation.
    """
    if factor < 1.0:
        # As wide as the mean over the samples that one sample stands for.
        relief = ndimage.gaussian_filter(relief, math.sqrt((1.0 / factor**2 - 1.0) / 12.0), mode="reflect")
    middle = 0.5 * (np.array(relief.shape) - 1.0)
    at = [(np.arange(n) - m) / factor + m for n, m in zip(relief.shape, middle, strict=True)]
    scaled = ndimage.map_coordinates(relief, np.meshgrid(*at, indexing="ij"), order=3, mode="reflect")
    return np.asarray(np.clip(scaled, relief.min(), relief.max()))


class LinearScaling:
    """Linear scaling as a descent method (`optimize.descent.driver.DescentMethod`): all in one step."""

    patience: int | None = None

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._original = self._pictures(problem.heights)
        self._plate = problem.plate_weights(self._original)

    @classmethod
    def of_run(cls, problem: Problem, steps: int, settings: MethodSettings) -> Self:
        """The method, which has no settings; see `MethodClass`."""
        return cls(problem)

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        """Nothing; see `MethodClass`."""
        return {}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        """The iterate at these heights; see the protocol."""
        problem = self._problem
        touch = problem.press(heights, gradients=False)
        pictures = self._original if heights is problem.heights else self._pictures(heights)
        change = change_percent(pictures, self._original, self._plate, problem.scene.weights)
        return Iterate(step, heights, touch.values, touch.contact_fraction, *change, {})

    def advance(self, iterate: Iterate) -> Iterate:
        """The original scaled to the first target, whatever the iterate."""
        return self.begin(iterate.step + 1, scaled_both_ways(self._problem), {})

    def reason_to_stop(self, iterate: Iterate) -> StopReason | None:
        """No rule beside the number of steps; see the protocol."""
        return None

    def _pictures(self, heights: Array) -> Array:
        problem, seen = self._problem, self._problem.scene.levelled(heights)
        pictures = problem.scene.render(seen, None, SAMPLES, problem.seed, problem.look)
        return np.asarray(pictures.numpy())


def _excess_of(problem: Problem, original: TouchMeasures | None = None) -> Callable[[Array], float]:
    """A function that presses a relief (rows, cols) and returns its excess over the first target."""
    target, single = problem.targets.each[0], replace(problem, precision=torch.float32)
    touch, relief_of_touch = original, problem.heights - problem.heights.min()

    def excess(relief: Array) -> float:
        nonlocal touch
        if touch is not original or touch is None or not np.array_equal(relief, relief_of_touch):
            touch = single.press(relief, None if touch is None else touch.pressure, gradients=False)
        return math.log(max(touch.means[target.quantity.name] / target.mean_goal, LEAST))

    return excess


def _height_scale(excess: Callable[[Array], float], relief: Array, tolerance: float) -> tuple[_Point, bool]:
    highest = _highest_scale(relief)
    return _scale_for(lambda scale: excess(relief * scale), min(1.0, highest), (FLATTEST, highest), tolerance)


def _highest_scale(relief: Array) -> float:
    return max(1.0, HEIGHT_LIMIT_MM / float(relief.max()))


def _scale_for(
    excess: Callable[[float], float], first: float, limits: tuple[float, float], tolerance: float
) -> tuple[_Point, bool]:
    """A scale where the excess is at most `tolerance`, and whether there is one.

    The scales are searched outward from the first until the excess changes sign: on the side on which the
    excess falls, and where it changes its sign nowhere there, on the other. Where it does nowhere at all, the
    scale of the least excess is returned.
    """
    start = best = (first, excess(first))
    ends, stride, side = dict.fromkeys((1, -1), start), STRIDE, 1
    while abs(best[1]) > tolerance:
        scale, value = ends[side]
        following = min(max(scale * stride**side, limits[0]), limits[1])
        if following == scale:
            del ends[side]
            if not ends:
                return best, False
            side, stride = -side, STRIDE
            continue
        there = ends[side] = (following, excess(following))
        if value * there[1] <= 0.0:
            return _root(excess, (scale, value), there, tolerance), True
        best = min(best, there, key=lambda point: abs(point[1]))
        slope = (abs(value) - abs(there[1])) / abs(math.log(following / scale))
        if slope < 0.0 and ends.get(-side) == start:
            side, slope, there = -side, -slope, start
        stride = STRIDE
        if slope > 0.0:
            # As far as the slope says, and no farther than from one limit to the other.
            ahead = max(OVERSHOOT * abs(there[1]) / slope, math.log(LEAST_STRIDE))
            stride = math.exp(min(ahead, math.log(limits[1] / limits[0])))
    return best, True


def _root(excess: Callable[[float], float], one: _Point, other: _Point, tolerance: float) -> _Point:
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
    return best
