"""Ambient light by a trained net: how much of the sky each pixel of a relief sees, as its material counts it.

    radiance = that of the pixel's faces under a sky that nothing hides * openness

The first factor is exact (`visual.slope_table`). The second is a net's, from heights and lengths alone: no
unit, no light and no strength of it is in it, and a square turned or mirrored gives the same turned or
mirrored. It holds for the kind of material that it was trained with (`material_figures`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import torch
from torch import Tensor, nn
from torch.nn import functional

from surrogate.errors import InputError as SurrogateInputError
from surrogate.unet import UNet
from surrogate.weights import FOLDER, load_net
from visual.errors import InputError
from visual.slope_table import SlopeTable

KIND: Literal["look"] = "look"
REACHES = (3, 9, 27)
"""Sides, in pixels, of the squares over which heights are averaged for the net to compare with."""
CHANNELS = 5 + len(REACHES)
OPEN = 0.5413
"""softplus of it is 1: an untrained net sees all of the sky."""
MATERIAL_ANGLES = (0.5, 1.0, 1.4)
"""Radians between a face's normal and the vertical at which materials are compared."""
MATERIAL_TOLERANCE = 0.05


def inputs(heights: Tensor, size_mm: float, unhidden: Tensor) -> Tensor:
    """What the net sees: (batch, CHANNELS, n, n), all of order 1.

    Args:
        heights: (batch, n, n) mm.
        size_mm: side of the plate.
        unhidden: (batch, n, n) radiance if nothing hid the sky; only its proportions count.
    """
    n = heights.shape[-1]
    lengths = heights * (n / size_mm)
    ring = functional.pad(lengths[:, None], (1, 1, 1, 1), mode="replicate")[:, 0]
    away = ((torch.arange(n, dtype=heights.dtype, device=heights.device) + 0.5) * (2.0 / n) - 1.0).abs()
    means = [
        functional.avg_pool2d(lengths[:, None], reach, 1, reach // 2, count_include_pad=False)[:, 0]
        for reach in REACHES
    ]
    return torch.stack(
        (
            torch.asinh(0.5 * (ring[:, 1:-1, 2:] - ring[:, 1:-1, :-2])),
            torch.asinh(0.5 * (ring[:, 2:, 1:-1] - ring[:, :-2, 1:-1])),
            *(torch.asinh(lengths - mean) for mean in means),
            unhidden / unhidden.mean((-2, -1), keepdim=True) - 1.0,
            away.expand_as(heights),
            away[:, None].expand_as(heights),
        ),
        dim=-3,
    )


def openness(net: nn.Module, maps: Tensor) -> Tensor:
    """(batch, n, n), not negative."""
    return functional.softplus(net(maps)[:, 0] + OPEN)


@dataclass(frozen=True, eq=False)
class Sky:
    """Ambient light on a plate.

    Attributes:
        table: of the material under the whole sky, with the light's own strength.
        net: in single precision.
    """

    table: SlopeTable
    net: UNet

    def openness(self, heights: Tensor, size_mm: float, unhidden: Tensor) -> Tensor:
        """(n, n) share of what an unhidden sky would give; heights and radiance (n, n)."""
        maps = inputs(heights[None].float(), size_mm, unhidden[None].float())
        return openness(self.net, maps)[0].to(heights.dtype)


def material_figures(table: SlopeTable) -> dict[str, float]:
    """How a material's radiance under the whole sky falls as a face tilts; all that the net knows of it."""
    angles = torch.tensor((0.0, *MATERIAL_ANGLES), dtype=table.values.dtype)
    radiance = table(torch.tan(angles), torch.zeros_like(angles))[0]
    falls = (radiance[1:] / radiance[0]).tolist()
    return {f"sky at {angle:g} rad": fall for angle, fall in zip(MATERIAL_ANGLES, falls, strict=True)}


def validity(table: SlopeTable, samples: int) -> dict[str, float]:
    """What a net of ambient light holds for, by name."""
    return {"samples": float(samples), **material_figures(table)}


def trained_sky(table: SlopeTable, samples: int, folder: Path = FOLDER) -> Sky:
    """Ambient light by the trained net that lies in a folder.

    Raises:
        InputError: there is no such net, or it holds for another material or another number of samples.
    """
    try:
        net, card = load_net(KIND, folder)
    except SurrogateInputError as error:
        raise InputError(f"look.model: {error}") from error
    if (card.shape.inputs, card.shape.outputs) != (CHANNELS, 1):
        raise InputError(
            f"look.model: {folder}: shape: {card.shape.inputs} maps in and {card.shape.outputs} out, "
            f"expected {CHANNELS} and 1"
        )
    _check(card.valid, validity(table, samples))
    return Sky(table, net)


def _check(trained: Mapping[str, float], asked: Mapping[str, float]) -> None:
    for name, value in asked.items():
        if name not in trained:
            raise InputError(f"look.model: the net's card does not tell its {name}")
        if abs(trained[name] - value) > (MATERIAL_TOLERANCE if name != "samples" else 0.0):
            what = "height samples a side" if name == "samples" else f"a material with {name}"
            raise InputError(
                f'look.model: the net is trained for {what} {trained[name]:.3g}, not {value:.3g}; use "exact"'
            )
