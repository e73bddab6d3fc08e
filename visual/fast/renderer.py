"""Fast renderer: pictures from straight above by shadow sweeps, BSDF tables and an ambient net.

In torch alone, a picture of 128 x 128 pixels takes milliseconds, and so does its gradient, shadows included
(docs/learned.md has errors and times). Lights are parallel or quadratures of parallel ones, ambient light is
of constant radiance, light is direct, and every pixel is centred on a height sample.
"""

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from visual.fast.ambient_net import AmbientLight
from visual.fast.bsdf_table import BsdfTable
from visual.fast.lit_picture import lit_picture, pooled_faces
from visual.fast.refinement import face_slopes, refined
from visual.fast.shadow_sweep import ShadowSweep, shadow_sweep
from visual.lights.parallel import OVERHEAD


@dataclass(frozen=True, eq=False)
class FastRenderer:
    """A plate under lights that shine one condition at a time, each with the ambient light.

    Attributes:
        samples: height samples a side, n, and pixels.
        size_mm: side of the plate.
        toward: unit vectors toward parallel lights.
        condition: for each of these lights the number of the picture in which the light shines.
        conditions: number of pictures.
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
        """Render reliefs, differentiably; in single precision whatever that of the heights.

        Args:
            heights: (..., n, n) mm.

        Returns:
            (..., conditions, n, n) radiance.
        """
        flat = heights.reshape(-1, *heights.shape[-2:])
        each = torch.stack([self._pictures(relief.float()) for relief in flat])
        return each.view(*heights.shape[:-2], *each.shape[1:]).to(heights.dtype)

    def sweep(self, toward: tuple[float, float, float], dtype: torch.dtype) -> ShadowSweep | None:
        """The shadow sweep of a light; None if the light stands straight above and casts no shadow."""
        if math.hypot(*toward[:2]) <= OVERHEAD:
            return None
        return shadow_sweep(self.samples, self.size_mm, toward, dtype)

    def _pictures(self, heights: Tensor) -> Tensor:
        slopes = face_slopes(heights, self.size_mm)
        parts: list[list[Tensor]] = [[] for _ in range(self.conditions)]
        if self.table is not None:
            fine = refined(heights)
            radiance = self.table.to(heights.dtype)(*slopes)
            for toward, condition, faces in zip(self.toward, self.condition, radiance, strict=True):
                parts[condition].append(lit_picture(fine, faces, self.sweep(toward, heights.dtype)))
        if self.ambient is not None:
            unoccluded = pooled_faces(None, self.ambient.table.to(heights.dtype)(*slopes)[0])
            ambient = unoccluded * self.ambient.visibility(heights, self.size_mm, unoccluded)
            for shining in parts:
                shining.append(ambient)
        dark = heights.new_zeros(heights.shape)
        return torch.stack([sum(shining, dark) for shining in parts])
