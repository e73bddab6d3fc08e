"""Pictures from straight above in torch alone: swept shadows, tabulated materials, ambient light by a net.

No renderer and no ray: a picture of 128 x 128 pixels takes milliseconds, and so does its gradient, shadows
included (docs/learned.md has errors and times). What it can show is little: parallel lights, or lights that
some parallel ones stand for, constant light from all around, direct light only, one pixel at each sample.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from visual.fast import shadow_sweep as swept
from visual.fast.ambient_net import AmbientLight
from visual.fast.bsdf_table import BsdfTable

EVERY = -1
"""Condition of a light that shines in all of them."""
OVERHEAD = 1e-6
"""Horizontal part of the direction toward a light straight above, which casts no shadow."""


@dataclass(frozen=True, eq=False)
class FastRenderer:
    """A plate under lights that shine one at a time, each with the ambient light.

    Attributes:
        samples: height samples a side, and pixels.
        size_mm: side of the plate.
        toward: unit vectors toward parallel lights.
        condition: for each of them the number of the picture that it shines in, or `EVERY`.
        conditions: how many pictures there are.
        table: radiance of faces under each light; None without lights.
        ambient: light from all around; None without.
    """

    samples: int
    size_mm: float
    toward: tuple[tuple[float, float, float], ...]
    condition: tuple[int, ...]
    conditions: int
    table: BsdfTable | None
    ambient: AmbientLight | None

    def pictures(self, heights: Tensor) -> Tensor:
        """(..., conditions, n, n) radiance of heights (..., n, n) in mm, differentiable by them.

        All in single precision, whatever that of the heights.
        """
        flat = heights.reshape(-1, *heights.shape[-2:])
        each = torch.stack([self._pictures(relief.float()) for relief in flat])
        return each.view(*heights.shape[:-2], *each.shape[1:]).to(heights.dtype)

    def _pictures(self, heights: Tensor) -> Tensor:
        slopes = swept.slopes(heights, self.size_mm)
        alone: list[list[Tensor]] = [[] for _ in range(self.conditions)]
        if self.table is not None:
            fine = swept.refined(heights)
            radiance = self.table.to(heights.dtype)(*slopes)
            for toward, condition, faces in zip(self.toward, self.condition, radiance, strict=True):
                way = None
                if math.hypot(*toward[:2]) > OVERHEAD:
                    way = swept.sweep(self.samples, self.size_mm, toward, heights.dtype)
                picture = swept.lit_picture(fine, faces, way)
                for shining in alone if condition == EVERY else alone[condition : condition + 1]:
                    shining.append(picture)
        if self.ambient is not None:
            unoccluded = swept.pooled_faces(None, self.ambient.table.to(heights.dtype)(*slopes)[0])
            around = unoccluded * self.ambient.visibility(heights, self.size_mm, unoccluded)
            for shining in alone:
                shining.append(around)
        dark = heights.new_zeros(heights.shape)
        return torch.stack([sum(shining, dark) for shining in alone])


def shared(pixels: Tensor) -> Tensor:
    """(2n, 2n): every pixel's value on its quarters."""
    return pixels.repeat_interleave(2, 0).repeat_interleave(2, 1)
