"""What one would do without this program: the relief scaled in height until it feels right."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from optimize.problem import HEIGHT_LIMIT_MM, Problem

Array = NDArray[np.float64]

SCAN = 12
"""Scales tried between flat and 3 mm before bisection: roughness need not rise with height everywhere."""


def linear_scaling(problem: Problem) -> Array | None:
    """The original scaled in height to the target (paper section 5.1.1), nearest to its own height.

    Returns:
        (rows, cols) mm, or None where no scale up to 3 mm meets the target.
    """
    relief = problem.heights - problem.heights.min()
    if relief.max() <= 0.0:
        return None
    highest = HEIGHT_LIMIT_MM / relief.max()

    def excess(scale: float) -> float:
        feel = problem.feel(relief * scale, gradients=False)
        if problem.targets.roughness is not None:
            return feel.roughness / problem.targets.roughness - 1.0
        assert problem.targets.contact_area_mm2 is not None
        return feel.contact_area_mm2 / problem.targets.contact_area_mm2 - 1.0

    scales = [*np.geomspace(0.05, 1.0, SCAN), *np.linspace(1.0, max(highest, 1.0), SCAN)[1:]]
    values = [excess(s) for s in scales]
    crossings = [
        (scales[i], scales[i + 1], values[i])
        for i in range(len(scales) - 1)
        if values[i] * values[i + 1] <= 0.0 and scales[i + 1] <= highest
    ]
    if not crossings:
        return None
    low, high, at_low = min(crossings, key=lambda c: abs(np.log(np.sqrt(c[0] * c[1]))))
    for _ in range(20):
        middle = 0.5 * (low + high)
        value = excess(middle)
        if abs(value) < 0.1 * problem.targets.tolerance:
            return np.asarray(relief * middle)
        if value * at_low > 0.0:
            low = middle
        else:
            high = middle
    return np.asarray(relief * (0.5 * (low + high)))
