"""After the descent: the feel and the look of the result, measured apart from what the descent believed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

import tactile
from optimize.problem import Problem
from tactile.model import ModelName

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TouchMeasured:
    """The feel of a relief by a model named `by`.

    Attributes:
        strain, pressure: (resolution, resolution); pressure in MPa.
    """

    by: ModelName
    roughness: float
    contact_area_mm2: float
    contact_fraction: float
    strain: Array
    pressure: Array

    @property
    def resolution(self) -> int:
        return len(self.strain)


def measure_touch(
    problem: Problem, heights: Array, by: ModelName, resolution: int | None = None
) -> TouchMeasured:
    """Press anew: from a cold start, in double precision, roughness over all offsets.

    Args:
        heights: (rows, cols) mm.
        by: "layer" or "fem".
        resolution: samples a side at which the skin meets the relief; None: the relief's own.
    """
    field = torch.as_tensor(heights)
    if resolution is not None:
        field = tactile.resampled(field, resolution)
    touch = tactile.press(field, problem.size_mm, problem.skin, by)
    return TouchMeasured(
        by,
        float(tactile.roughness(touch.strain, problem.size_mm)),
        float(tactile.contact_area(touch.gap, problem.size_mm)),
        float(touch.contact_fraction),
        touch.strain.numpy(),
        touch.pressure.numpy(),
    )


def converged_pictures(
    problem: Problem, heights: Array, samples: int, seed: int, resolution: int | None = None
) -> Array:
    """Pictures of every condition by Mitsuba at many samples, (conditions, rows, cols)."""
    rendered = problem.scene.render(heights, samples=samples, seed=seed, resolution=resolution)
    return np.asarray(rendered.numpy())
