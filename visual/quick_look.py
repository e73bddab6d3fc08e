"""Pictures from straight above in torch alone: swept shadows, tabulated materials, ambient light by a net.

No renderer and no ray: a picture of 128 x 128 pixels takes milliseconds, and so does its gradient, shadows
included (docs/learned.md has errors and times). What it can show is little: parallel lights, or lights that
some parallel ones stand for, constant light from all around, direct light only, one pixel at each sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from visual import swept
from visual.sky import Sky
from visual.slope_table import SlopeTable

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class QuickLook:
    """A plate under lights that shine one at a time, each with the ambient light.

    Attributes:
        samples: height samples a side, and pixels.
        size_mm: side of the plate.
        toward: (lights, 3) unit vectors toward parallel lights.
        condition: (lights,) the picture that each of them shines in.
        conditions: how many there are.
        table: radiance of faces under each light; None without lights.
        sky: light from all around; None without.
    """

    samples: int
    size_mm: float
    toward: tuple[tuple[float, float, float], ...]
    condition: tuple[int, ...]
    conditions: int
    table: SlopeTable | None
    sky: Sky | None

    def pictures(self, heights: Tensor) -> Tensor:
        """(..., conditions, n, n) radiance of heights (..., n, n) in mm, differentiable by them."""
        flat = heights.reshape(-1, *heights.shape[-2:])
        each = torch.stack([swept.pooled(self._quarters(relief)) for relief in flat])
        return each.view(*heights.shape[:-2], *each.shape[1:])

    def _quarters(self, heights: Tensor) -> Tensor:
        """(conditions, 2n, 2n) radiance of the quarters of pixels."""
        slopes = swept.slopes(heights, self.size_mm)
        fine = swept.refined(heights)
        pictures = [heights.new_zeros(2 * self.samples, 2 * self.samples)] * self.conditions
        if self.table is not None:
            radiance = self.table.to(heights.dtype)(*slopes)
            for toward, condition, faces in zip(self.toward, self.condition, radiance, strict=True):
                way = swept.sweep(self.samples, self.size_mm, toward, heights.dtype)
                shares = swept.lit_shares(way.clearance(fine))
                pictures[condition] = pictures[condition] + swept.shown(shares * swept.of_quarters(faces))
        if self.sky is not None:
            unhidden = swept.shown(swept.of_quarters(self.sky.table.to(heights.dtype)(*slopes)[0]))
            openness = self.sky.openness(heights, self.size_mm, swept.pooled(unhidden))
            around = unhidden * _spread(openness)
            pictures = [picture + around for picture in pictures]
        return torch.stack(pictures)


def _spread(pixels: Tensor) -> Tensor:
    """(2n, 2n): every pixel's value on its quarters."""
    return pixels.repeat_interleave(2, 0).repeat_interleave(2, 1)
