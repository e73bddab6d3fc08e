"""Fast renderer: pictures from straight above by shadow sweeps, BSDF tables and an ambient net.

In torch alone, a picture of 128 x 128 pixels takes milliseconds, and so does its gradient, shadows included
(docs/evidence/speed.md has errors and times). Lights are parallel or quadratures of parallel ones, ambient
light is of constant radiance, and light is direct. Where a pixel is not centred on each height sample, and
where the film's filter is no box, a picture weighs quarters of samples.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.surface import Surface
from visual.fast.ambient_net import AmbientLight, UnoccludedLight
from visual.fast.bsdf_table import BsdfTable
from visual.fast.lit_picture import lit_picture, lit_share, pooled_faces
from visual.fast.refinement import face_slopes, on_quarters, on_triangles, pixel_means, quarter_means, refined
from visual.fast.shadow_sweep import ShadowSweep, shadow_sweep
from visual.geometry.halo import halo_of
from visual.lights.parallel import OVERHEAD


class FilmWeights(NamedTuple):
    """Weights of half samples along one side of a picture, by a film; each row has the sum 1.

    Attributes:
        of_quarters: (pixels, 2n), for pixels, along a side of n samples.
        between_quarters: (2n, 2n), for pictures in which quarters of samples are pixels; None for a box.
    """

    of_quarters: sp.csr_matrix
    between_quarters: sp.csr_matrix | None


def box_weights(pixels: int, samples: int) -> FilmWeights:
    """Weights of a box filter on so many pixels a side over so many height samples."""
    start, end = np.arange(pixels)[:, None], np.arange(pixels)[:, None] + 1.0
    quarter = np.arange(2 * samples) * (pixels / (2 * samples))
    overlap = np.minimum(end, quarter + pixels / (2 * samples)) - np.maximum(start, quarter)
    return FilmWeights(sp.csr_matrix(np.maximum(overlap, 0.0)), None)


@dataclass(frozen=True, eq=False)
class FastRenderer:
    """A plate under lights that shine one condition at a time, each with the ambient light.

    Attributes:
        surface: of the plate, r x c height samples.
        toward: unit vectors toward parallel lights.
        condition: for each of these lights the number of the picture in which the light shines.
        conditions: number of pictures.
        table: radiance of faces under each light; None without lights.
        ambient: light from all around; None without.
        film: weights of the film along y and x; None for a box and one pixel at each sample.
        shadows: whether the parallel lights cast shadows.
        rise_mm: expected from the lowest to the highest point of the reliefs, by which shadows come in from
            the neighbours of a tile.
    """

    surface: Surface
    toward: tuple[tuple[float, float, float], ...]
    condition: tuple[int, ...]
    conditions: int
    table: BsdfTable | None
    ambient: AmbientLight | UnoccludedLight | None
    film: tuple[FilmWeights, FilmWeights] | None = None
    shadows: bool = True
    rise_mm: float = HEIGHT_LIMIT_MM

    def pictures(self, heights: Tensor) -> Tensor:
        """Render reliefs, differentiably; in single precision whatever that of the heights.

        Args:
            heights: (..., r, c) mm.

        Returns:
            (..., conditions, rows, cols) radiance.
        """
        flat = heights.reshape(-1, *heights.shape[-2:])
        show = self._pictures if self.film is None else self._filtered
        each = torch.stack([show(relief.float()) for relief in flat])
        return each.view(*heights.shape[:-2], *each.shape[1:]).to(heights.dtype)

    def sweep(self, toward: tuple[float, float, float], dtype: torch.dtype) -> ShadowSweep | None:
        """The shadow sweep of a light; None if the light casts no shadow, as from straight above."""
        if not self.shadows or math.hypot(*toward[:2]) <= OVERHEAD:
            return None
        return shadow_sweep(self.surface, toward, dtype, halo_of(self.surface, self.rise_mm, [toward]))

    def slopes(self, heights: Tensor) -> tuple[Tensor, Tensor]:
        """Slopes dz/dx and dz/dy of all faces; see `face_slopes`."""
        return face_slopes(heights, self.surface.width_mm, self.surface.repeats)

    def _pictures(self, heights: Tensor) -> Tensor:
        slopes = self.slopes(heights)
        parts: list[list[Tensor]] = [[] for _ in range(self.conditions)]
        if self.table is not None:
            fine = refined(heights, self.surface.repeats)
            radiance = self.table.to(heights.dtype)(*slopes)
            for toward, condition, faces in zip(self.toward, self.condition, radiance, strict=True):
                parts[condition].append(lit_picture(fine, faces, self.sweep(toward, heights.dtype)))
        if self.ambient is not None:
            unoccluded = pooled_faces(None, self.ambient.table.to(heights.dtype)(*slopes)[0])
            ambient = unoccluded * self.ambient.visibility(heights, self.surface, unoccluded)
            for shining in parts:
                shining.append(ambient)
        dark = heights.new_zeros(heights.shape)
        return torch.stack([sum(shining, dark) for shining in parts])

    def _filtered(self, heights: Tensor) -> Tensor:
        """Pictures by the weights of the film, over quarters of samples."""
        assert self.film is not None
        slopes = self.slopes(heights)
        rows, cols = self.surface.shape
        quarters = [heights.new_zeros(2 * rows, 2 * cols) for _ in range(self.conditions)]
        if self.table is not None:
            fine = refined(heights, self.surface.repeats)
            radiance = self.table.to(heights.dtype)(*slopes)
            for toward, condition, faces in zip(self.toward, self.condition, radiance, strict=True):
                share = lit_share(fine, self.sweep(toward, heights.dtype))
                lit = on_triangles(faces) if share is None else share * on_triangles(faces)
                quarters[condition] = quarters[condition] + quarter_means(lit)
        if self.ambient is not None:
            unoccluded = quarter_means(on_triangles(self.ambient.table.to(heights.dtype)(*slopes)[0]))
            visibility = self.ambient.visibility(heights, self.surface, pixel_means(unoccluded))
            quarters = [shining + unoccluded * on_quarters(visibility) for shining in quarters]
        down, across = (torch.as_tensor(film.of_quarters.toarray()).to(heights.dtype) for film in self.film)
        return torch.stack([down @ shining @ across.T for shining in quarters])
