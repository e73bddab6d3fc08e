"""After the descent: the feel and the look of the result, measured apart from what the descent believed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

import tactile
from optimize.descent.problem import Problem
from tactile.limits import FEM_MESH
from tactile.model import ModelName
from visual.noise import Batches, batched

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TouchMeasured:
    """The feel of a relief by a model named `by`.

    Attributes:
        mesh: nodes a side of the finite elements; None if they were not asked.
        strain, pressure: (rows, cols); pressure in MPa.
    """

    by: ModelName
    mesh: int | None
    roughness: float
    contact_area_mm2: float
    contact_fraction: float
    strain: Array
    pressure: Array


def measure_touch(problem: Problem, heights: Array, by: ModelName, mesh: int = FEM_MESH) -> TouchMeasured:
    """Press anew: from a cold start, in double precision, roughness over all offsets.

    Args:
        heights: (rows, cols) mm.
        by: "layer", "quick", "net" or "fem".
        mesh: nodes a side of the finite elements.
    """
    touch = tactile.press(torch.as_tensor(heights), problem.size_mm, problem.skin, by, mesh=mesh)
    return TouchMeasured(
        by,
        mesh if by == "fem" else None,
        float(tactile.roughness(touch.strain, problem.size_mm)),
        float(tactile.contact_area(touch.gap, problem.size_mm)),
        float(touch.contact_fraction),
        touch.strain.numpy(),
        touch.pressure.numpy(),
    )


def converged_pictures(
    problem: Problem, heights: Array, samples: int, seed: int, resolution: int | None = None
) -> Batches:
    """Pictures of every condition by Mitsuba at many samples, in batches that tell their noise."""
    return batched(problem.scene, heights, samples, seed, resolution=resolution)
