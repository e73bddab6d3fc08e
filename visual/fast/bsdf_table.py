"""BSDF table: radiance of faces by their slopes, toward a camera, differentiable.

The entries lie on a square grid of tilted normals: a normal at angle t from the vertical stands at distance t
from the middle, in the normal's azimuth, so that steep faces have as many entries as level ones. Between
entries the table is bilinear.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from torch import Tensor
from torch.nn import functional

from visual.exact.face_shading import unshadowed
from visual.lights.parallel import GOLDEN_ANGLE, ParallelLights

ENTRIES = 384
"""Entries a side for each light: within 0.1 % of the material, light after light, on gravel."""
AMBIENT_ENTRIES = 96
"""Entries a side for ambient light, whose radiance is smoother."""
SKY_DIRECTIONS = 512
"""Directions of the quadrature of the sky."""
BATCH = 64
"""Directions of the sky evaluated at once, which bounds memory."""
STEEPEST = 1e4
"""Slope of the outermost entries: a vertical face has none."""
LEAST_COSINE = 0.05
"""Least cosine between a face and a camera at its side at which the face's radiance is tabulated."""
ABOVE = np.array([0.0, 0.0, 1.0])
"""Unit vector toward the camera."""


@dataclass(frozen=True, eq=False)
class BsdfTable:
    """Radiance of a face under each of some lights.

    Attributes:
        values: (lights, k, k); rows by the tilt of the face along y, columns by that along x.
    """

    values: Tensor

    def __call__(self, slope_x: Tensor, slope_y: Tensor) -> Tensor:
        """Radiance (lights, ...) of faces with slopes dz/dx and dz/dy (...)."""
        steep = torch.sqrt(slope_x.square() + slope_y.square() + 1e-12)
        scale = torch.atan(steep) / (steep * (0.5 * math.pi))
        place = torch.stack((slope_x * scale, slope_y * scale), dim=-1).reshape(1, 1, -1, 2)
        radiance = functional.grid_sample(self.values[None], place, "bilinear", "border", align_corners=True)
        return radiance.view(len(self.values), *slope_x.shape)

    def to(self, dtype: torch.dtype) -> BsdfTable:
        """A copy of the table in another precision; the table in single precision is kept."""
        if dtype == self.values.dtype:
            return self
        return self._single if dtype == torch.float32 else BsdfTable(self.values.to(dtype))

    @cached_property
    def _single(self) -> BsdfTable:
        return BsdfTable(self.values.float())


def light_table(
    bsdf: Any,
    lights: ParallelLights,
    toward_camera: NDArray[np.float64] = ABOVE,
    entries: int = ENTRIES,
) -> BsdfTable:
    """Tabulate a material under each of some parallel lights alone.

    Args:
        bsdf: of Mitsuba.
        lights: parallel lights.
        toward_camera: unit vector.
        entries: a side for each light.
    """
    slope_x, slope_y = _slopes(entries)
    radiance = [
        unshadowed(bsdf, slope_x, slope_y, lights.single(number), toward_camera)
        for number in range(len(lights))
    ]
    values = np.concatenate(radiance).reshape(-1, entries, entries)
    normals = np.stack((-slope_x, -slope_y, np.ones_like(slope_x))) / np.sqrt(1.0 + slope_x**2 + slope_y**2)
    seen = (toward_camera @ normals).reshape(entries, entries) > LEAST_COSINE
    if toward_camera[2] < 1.0 - LEAST_COSINE:
        # A face turned to its edge counts as one still seen: radiance does not fall to 0 there, as it would.
        row, col = distance_transform_edt(~seen, return_distances=False, return_indices=True)
        values = values[:, row, col]
    return BsdfTable(torch.from_numpy(values))


def ambient_table(bsdf: Any, radiance: NDArray[np.float64]) -> BsdfTable:
    """Tabulate a material under an unoccluded sky of constant radiance, down to the horizon.

    The sky is a golden-angle spiral of directions, uniform in solid angle.

    Args:
        bsdf: of Mitsuba.
        radiance: (3,) red, green and blue.
    """
    index = np.arange(SKY_DIRECTIONS)
    z = (index + 0.5) / SKY_DIRECTIONS
    planar = np.sqrt(1.0 - z * z)
    toward = np.stack((planar * np.cos(GOLDEN_ANGLE * index), planar * np.sin(GOLDEN_ANGLE * index), z), 1)
    share = np.outer(np.full(SKY_DIRECTIONS, 2.0 * np.pi / SKY_DIRECTIONS), radiance)
    slope_x, slope_y = _slopes(AMBIENT_ENTRIES)
    total = np.zeros(AMBIENT_ENTRIES**2)
    for first in range(0, SKY_DIRECTIONS, BATCH):
        part = slice(first, first + BATCH)
        total += unshadowed(bsdf, slope_x, slope_y, ParallelLights(toward[part], share[part]), ABOVE).sum(0)
    return BsdfTable(torch.from_numpy(total.reshape(1, AMBIENT_ENTRIES, AMBIENT_ENTRIES)))


def _slopes(entries: int) -> tuple[Any, Any]:
    """dz/dx and dz/dy (entries²,) of the table's entries."""
    tilt = np.linspace(-0.5 * np.pi, 0.5 * np.pi, entries)
    y, x = np.meshgrid(tilt, tilt, indexing="ij")
    angle = np.hypot(x, y)
    steep = np.tan(np.minimum(angle, math.atan(STEEPEST)))
    scale = np.where(angle > 0.0, steep / np.where(angle > 0.0, angle, 1.0), 1.0)
    return (x * scale).ravel(), (y * scale).ravel()
