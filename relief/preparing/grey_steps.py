"""Dequantisation of heights of few levels, which are terraces to a finger and to light, to smooth slopes.

A slope that rises one step over many samples is stored as a staircase. The heights are estimated again,
as the surface of least weighted curvature within half a step of the stored heights. Weights fall with the
curvature of the picture nearby: flat terraces become slopes, while crests and edges stay.
"""

from typing import Any

import numpy as np
import scipy

from relief.ground.arrays import Array
from relief.ground.progress import Stage, stage
from relief.reading.terraces import Steps

ROUNDING_PRECISION = 12.0
"""Inverse variance of the rounding to levels, in local steps**-2: errors are uniform over one step."""
LEAST_CURVATURE = 0.02
"""Curvature, in local steps a sample squared, that a surface may always have; below, slopes become facets."""
NEARBY = (2.0, 1.0)
"""Standard deviations, in samples, of means of squared curvature: of the stored steps, then of the result.

The first must span the steps themselves. The second keeps creases that the first has blurred.
"""
ITERATIONS = 50
"""Iterations of each of the two estimates; twice as many change slopes by a few per cent of their error."""
REMEMBERED = 6
"""Earlier gradients that L-BFGS-B keeps; each takes the memory of a picture."""


def smooth_steps(grey: Array, steps: Steps, pixels: float = 1.0) -> Array:
    """Smooth the steps of a picture with few grey values.

    Args:
        grey: (rows, cols) values, rounded to levels before they were averaged or interpolated, if they were.
        steps: The steps of the levels, which need not be equal.
        pixels: Pixels of the picture along one sample.

    Returns:
        (rows, cols) values, each within half of the local step of ``grey``; within less on slopes where it is
        a mean of several pixels, as their errors of rounding cancel.
    """
    local = steps.near(grey)
    step = float(np.median(local))
    stored, local = grey / step, local / step
    smooth, blurred = stored, scipy.ndimage.gaussian_filter(stored, NEARBY[0], mode="nearest")
    if pixels > 1.0:
        # A mean over a triangle two samples wide leaves sinc² of the rounding of a slope, or a mean of noise.
        slopes = np.gradient(scipy.ndimage.gaussian_filter(stored, NEARBY[1], mode="nearest"))
        rise = np.minimum(np.hypot(*slopes) / local, 1.0)
        local = local * np.maximum(np.sinc(rise) ** 2, 1.0 / (1.5 * pixels))
    with stage("smoothing the steps of grey", len(NEARBY) * ITERATIONS, at_most=True) as advance:
        for nearby in NEARBY:
            smooth = _estimate(stored, local, smooth, _squared_curvature(blurred, nearby), advance)
            blurred = smooth
    within = np.clip(smooth * step, grey - 0.5 * step * local, grey + 0.5 * step * local)
    return np.clip(within, grey.min(), grey.max())


def _second_differences(heights: Array) -> tuple[Array, Array, Array]:
    """Second differences along columns (rows - 2, cols), along rows (rows, cols - 2) and mixed (- 1, - 1)."""
    down, right = np.diff(heights, axis=0), np.diff(heights, axis=1)
    return np.diff(down, axis=0), np.diff(right, axis=1), np.diff(down, axis=1)


def _squared_curvature(heights: Array, nearby: float) -> Array:
    """Mean square of the three second differences near each sample."""
    down, right, mixed = _second_differences(heights)
    squares = np.zeros_like(heights)
    squares[1:-1] += down**2
    squares[:, 1:-1] += right**2
    squares[1:, 1:] += 2.0 * mixed**2
    return scipy.ndimage.gaussian_filter(squares, nearby, mode="nearest") / 3.0


def _estimate(stored: Array, local: Array, start: Array, squared_curvature: Array, advance: Stage) -> Array:
    """The most likely heights within half of the local step of the stored ones; unit: the median step."""
    weight = 1.0 / (squared_curvature + (LEAST_CURVATURE * local) ** 2)
    precision = ROUNDING_PRECISION / local**2
    between = (weight[1:, 1:] + weight[:-1, :-1] + weight[1:, :-1] + weight[:-1, 1:]) / 4.0
    weights = weight[1:-1], weight[:, 1:-1], 2.0 * between

    def energy(flat: Array) -> tuple[float, Array]:
        heights = flat.reshape(stored.shape)
        off = heights - stored
        curvature = _second_differences(heights)
        down, right, mixed = (w * c for w, c in zip(weights, curvature, strict=True))
        gradient = precision * off
        for part, view in ((down, gradient), (right.T, gradient.T)):
            view[2:] += part
            view[1:-1] -= 2.0 * part
            view[:-2] += part
        gradient[1:, 1:] += mixed
        gradient[:-1, :-1] += mixed
        gradient[1:, :-1] -= mixed
        gradient[:-1, 1:] -= mixed
        terms = np.vdot(precision * off, off)
        terms += sum(np.vdot(p, c) for p, c in zip((down, right, mixed), curvature, strict=True))
        return 0.5 * float(terms), gradient.ravel()

    bounds = np.stack([(stored - 0.5 * local).ravel(), (stored + 0.5 * local).ravel()], axis=1)
    settings: Any = {"jac": True, "method": "L-BFGS-B", "callback": lambda _: advance()}
    settings["options"] = {"maxiter": ITERATIONS, "maxcor": REMEMBERED, "ftol": 1e-7}
    result = scipy.optimize.minimize(energy, start.ravel(), bounds=bounds, **settings)
    return np.asarray(result.x).reshape(stored.shape)
