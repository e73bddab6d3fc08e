"""Ambient light by a trained net: what share of the sky each pixel of a relief sees.

    radiance = unoccluded radiance of the pixel's faces * approximate visibility * correction by the net

The first factor is exact (`visual.fast.bsdf_table`), the second comes from sampled horizons
(`visual.fast.horizons`). The net sees proportions of lengths and radiances only, neither a unit nor the
light's strength. The net holds for the kind of material that it was trained with (`material_figures`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Literal

import torch
from torch import Tensor, nn
from torch.nn import functional

from relief.ground.errors import InputError
from relief.surface import Surface
from surrogate.nets.unet import UNet
from surrogate.nets.weights import FOLDER, load_net_for
from visual.fast.bsdf_table import BsdfTable
from visual.fast.horizons import DIRECTIONS, approximate_visibility, horizons
from visual.fast.refinement import ENDS, Repeats, padded

KIND: Literal["look"] = "look"
MEAN_SIDES = (3, 9, 27)
"""Sides, in pixels, of the squares whose mean height the net compares with each height."""
CHANNELS = 6 + len(MEAN_SIDES) + len(DIRECTIONS)
AROUND = 16
"""Samples of a tile's neighbours that the net sees on each side."""
NO_SIDES = 0.5
"""Distance from the middle, of 1, as input of the net on an axis without sides: the mean over a plate. With
0 ambient light on tiles of gravel and grass is 2.6 and 3.0 % too dark, with 0.5 1 and 1.5, as on plates."""
NEUTRAL_OUTPUT = 0.5413
"""Offset of the net's output; its softplus is 1, so that an untrained net corrects nothing."""
MATERIAL_ANGLES = (0.5, 1.0, 1.4)
"""Angles between a face's normal and the vertical, radians, at which materials are compared."""
MATERIAL_TOLERANCE = 0.05
"""Largest difference of a `material_figures` value between the net's material and another one."""


def inputs(heights: Tensor, size_mm: float, unoccluded: Tensor, repeats: Repeats = ENDS) -> Tensor:
    """Input maps of the net, all of order 1; the first is the approximate visibility.

    Args:
        heights: (batch, r, c) mm.
        size_mm: width of the plate.
        unoccluded: (batch, r, c) radiance under a sky that nothing hides; only its proportions count.
        repeats: along y and x.

    Returns:
        (batch, CHANNELS, r, c).
    """
    lengths = heights * (heights.shape[-1] / size_mm)
    ring = padded(lengths, repeats)
    away_y, away_x = (_away(n, wraps, heights) for n, wraps in zip(heights.shape[-2:], repeats, strict=True))
    means = [_mean_around(lengths, side, repeats) for side in MEAN_SIDES]
    slope_x = 0.5 * (ring[:, 1:-1, 2:] - ring[:, 1:-1, :-2])
    slope_y = 0.5 * (ring[:, :-2, 1:-1] - ring[:, 2:, 1:-1])
    tangents = horizons(lengths, repeats)
    return torch.stack(
        (
            approximate_visibility(tangents, slope_x, slope_y),
            functional.softsign(slope_x),
            functional.softsign(slope_y),
            *torch.atan(tangents).unbind(1),
            *(functional.softsign(lengths - mean) for mean in means),
            unoccluded / unoccluded.mean((-2, -1), keepdim=True) - 1.0,
            away_x.expand_as(heights),
            away_y[:, None].expand_as(heights),
        ),
        dim=-3,
    )


def _away(n: int, wraps: bool, like: Tensor) -> Tensor:
    """(n,) distance from the middle of the plate, 1 at its sides; `NO_SIDES` on an axis that has none."""
    if wraps:
        return like.new_full((n,), NO_SIDES)
    return ((torch.arange(n, dtype=like.dtype, device=like.device) + 0.5) * (2.0 / n) - 1.0).abs()


def _mean_around(lengths: Tensor, side: int, repeats: Repeats) -> Tensor:
    """Means (batch, r, c) over squares of `side` samples a side, cut off where the plate ends."""
    down, across = (
        _running_mean(n, side, wraps).to(lengths)
        for n, wraps in zip(lengths.shape[-2:], repeats, strict=True)
    )
    return down @ lengths @ across.T


@lru_cache(maxsize=8)
def _running_mean(n: int, side: int, wraps: bool) -> Tensor:
    """(n, n) matrix of running means over `side` samples."""
    place = torch.arange(n)
    apart = (place[:, None] - place).abs()
    if wraps:
        apart = torch.minimum(apart, n - apart)
    near = (apart <= side // 2).float()
    return near / near.sum(1, keepdim=True)


def sky_visibility(net: nn.Module, maps: Tensor) -> Tensor:
    """Sky visibility (batch, r, c), not negative, from the `inputs` of a net."""
    return maps[:, 0] * functional.softplus(net(maps)[:, 0] + NEUTRAL_OUTPUT)


@dataclass(frozen=True, eq=False)
class AmbientLight:
    """Ambient light on a plate.

    Attributes:
        table: of the material under the whole sky, with the light's own strength.
        net: in single precision.
    """

    table: BsdfTable
    net: UNet

    def visibility(self, heights: Tensor, surface: Surface, unoccluded: Tensor) -> Tensor:
        """Share of the unoccluded radiance that reaches each pixel.

        The net sees lengths in units of the distance between samples, so that one net serves every grid. A
        side that is no multiple of the net's blocks is filled up by zeros, with which the net pads anyway. On
        an axis that repeats, the net also sees `AROUND` samples of the neighbours.

        Args:
            heights: (r, c) mm.
            surface: of the plate.
            unoccluded: (r, c) radiance of `table`.

        Returns:
            (r, c), not negative, differentiable by `heights` and `unoccluded`.
        """
        rows, cols = heights.shape
        maps = inputs(heights[None].float(), surface.width_mm, unoccluded[None].float(), surface.repeats)
        top, left = (AROUND if wraps else 0 for wraps in surface.repeats)
        for axis, beyond in ((2, top), (3, left)):
            if beyond:
                n = maps.shape[axis]
                maps = maps.index_select(axis, torch.arange(-beyond, n + beyond) % n)
        down, across = (-n % self.net.shape.multiple for n in maps.shape[-2:])
        if down or across:
            maps = functional.pad(maps, (0, across, 0, down))
        visibility = sky_visibility(self.net, maps)[0]
        return visibility[top : top + rows, left : left + cols].to(heights.dtype)


@dataclass(frozen=True, eq=False)
class UnoccludedLight:
    """Ambient light that nothing hides.

    Attributes:
        table: of the material under the whole sky, with the light's own strength.
    """

    table: BsdfTable

    def visibility(self, heights: Tensor, surface: Surface, unoccluded: Tensor) -> Tensor:
        """Visibility 1 everywhere; arguments and result as of `AmbientLight.visibility`."""
        return torch.ones_like(heights)


def material_figures(table: BsdfTable) -> dict[str, float]:
    """Radiance of tilted faces under the whole sky over that of a level face, by name."""
    angles = torch.tensor((0.0, *MATERIAL_ANGLES), dtype=table.values.dtype)
    radiance = table(torch.tan(angles), torch.zeros_like(angles))[0]
    falls = (radiance[1:] / radiance[0]).tolist()
    return {f"sky at {angle:g} rad": fall for angle, fall in zip(MATERIAL_ANGLES, falls, strict=True)}


def validity(table: BsdfTable, samples: int) -> dict[str, float]:
    """Range of validity of a net of ambient light, by name: height samples a side and material."""
    return {"samples": float(samples), **material_figures(table)}


def trained_ambient_light(table: BsdfTable, folder: Path = FOLDER) -> AmbientLight:
    """Load the trained net of a folder.

    Args:
        table: of the material under the whole sky.

    Raises:
        InputError: there is no such net, or it holds for another material.
    """
    net, card = load_net_for("look.model", KIND, CHANNELS, folder)
    _check(card.valid, material_figures(table))
    return AmbientLight(table, net)


def _check(trained: Mapping[str, float], requested: Mapping[str, float]) -> None:
    for name, value in requested.items():
        if name not in trained:
            raise InputError(f"look.model: the net's card lacks its {name}")
        if abs(trained[name] - value) > MATERIAL_TOLERANCE:
            raise InputError(
                f"look.model: the net is trained for a material with {name} {trained[name]:.3g}, "
                f'not {value:.3g}; use "exact"'
            )
