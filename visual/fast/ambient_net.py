"""Ambient light by a trained net: what share of the sky each pixel of a relief sees.

    radiance = unoccluded radiance of the faces * approximate sky visibility * correction by the net

The first factor is exact (`visual.fast.bsdf_table`). Openness is what rough horizons in eight directions
leave of
the light on a level matte face; the net mends it, from heights and lengths alone: no unit, no light and no
strength of it is in it, and a square turned or mirrored gives the same turned or mirrored. It holds for the
kind of material that it was trained with (`material_figures`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import torch
from torch import Tensor, nn
from torch.nn import functional

from relief.errors import InputError
from surrogate.nets.unet import UNet
from surrogate.nets.weights import FOLDER, load_net
from visual.fast.bsdf_table import BsdfTable

KIND: Literal["look"] = "look"
REACHES = (3, 9, 27)
"""Sides, in pixels, of the squares over which heights are averaged for the net to compare with."""
WAYS = ((0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1))
"""Rows and columns a step, of the directions of horizons; the second half is opposite to the first."""
DISTANCES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Steps at which a horizon is looked for."""
REACH = max(DISTANCES)
BITS = 15
"""Of a number in single precision that may tell something else: a tangent is exact to 2e-6 without them."""
LEVEL = 1e-6
"""Tangent of a horizon that nothing stands out of."""
CHANNELS = 6 + len(REACHES) + len(WAYS)
OPEN = 0.5413
"""softplus of it is 1: an untrained net mends nothing."""
MATERIAL_ANGLES = (0.5, 1.0, 1.4)
"""Radians between a face's normal and the vertical at which materials are compared."""
MATERIAL_TOLERANCE = 0.05


def horizons(lengths: Tensor) -> Tensor:
    """(batch, WAYS, n, n) tangents of how high the relief stands in each direction, at least 0.

    Looked for at a few distances only; beyond the plate there is nothing.

    Args:
        lengths: (batch, n, n) heights in units of the distance between samples.
    """
    found: Tensor = _Horizons.apply(lengths.float().contiguous())
    return found.to(lengths.dtype)


class _Horizons(torch.autograd.Function):
    """Where what stands out stands is kept only for a gradient: in the last bits of how steep it is."""

    @staticmethod
    def forward(ctx: Any, lengths: Tensor) -> Tensor:
        n, tracked = lengths.shape[-1], ctx.needs_input_grad[0]
        beside, half = functional.pad(lengths, (REACH,) * 4, value=-1e4), len(WAYS) // 2
        width = beside.shape[-1]
        # Two opposite ways at once: what lies there differs by a fixed step in memory.
        steepest = lengths.new_full((half, 2, len(lengths), n, n), LEVEL)
        steepest.view(torch.int32).bitwise_and_(~BITS)
        rise = torch.empty_like(steepest[0])
        bits, middle = rise.view(torch.int32), REACH * (width + 1)
        for (row, col), most in zip(WAYS[:half], steepest, strict=True):
            for number, step in enumerate(DISTANCES, 1):
                away = step * abs(row * width + col)
                there = beside.as_strided(rise.shape, (2 * away, width * width, width, 1), middle - away)
                torch.sub(there, lengths, out=rise)
                rise.mul_(1.0 / (step * math.hypot(row, col)))
                if tracked:
                    bits.bitwise_and_(~BITS).bitwise_or_(number)
                torch.maximum(most, rise, out=most)
            if row * width + col > 0:
                most.copy_(most.flip(0))
        steepest = steepest.transpose(0, 1).reshape(len(WAYS), len(lengths), n, n)
        if tracked:
            ctx.save_for_backward(steepest)
        return steepest.transpose(0, 1)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        (steepest,) = ctx.saved_tensors
        items, n = steepest.shape[1:3]
        width = n + 2 * REACH
        device = gradient.device
        way = torch.arange(len(WAYS), device=device)[:, None, None, None] * (BITS + 1)
        found = (steepest.view(torch.int32).bitwise_and(BITS) + way).view(-1)
        per_length, offset = (known.to(device) for known in _by_step(width))
        taken = gradient.transpose(0, 1) * per_length.index_select(0, found).view(steepest.shape)
        place = torch.arange(n, device=device) + REACH
        item = torch.arange(items, device=device)[:, None, None] * width**2
        own = item + place[:, None] * width + place
        there = own + offset.index_select(0, found).view(steepest.shape)
        to_beside = gradient.new_zeros(items * width * width)
        to_beside.index_add_(0, there.view(-1), taken.reshape(-1))
        inside = slice(REACH, REACH + n)
        return to_beside.view(items, width, width)[:, inside, inside] - taken.sum(0)


@lru_cache(maxsize=4)
def _by_step(width: int) -> tuple[Tensor, Tensor]:
    """By way and number of a distance (ways * (BITS + 1),): 1 over its length, and its step in a flat map.

    Number 0, of what nothing stands out of, has neither.
    """
    per_length, offset = torch.zeros(len(WAYS), BITS + 1), torch.zeros(len(WAYS), BITS + 1, dtype=torch.int64)
    for way, (row, col) in enumerate(WAYS):
        for number, step in enumerate(DISTANCES, 1):
            per_length[way, number] = 1.0 / (step * math.hypot(row, col))
            offset[way, number] = step * (row * width + col)
    return per_length.view(-1), offset.view(-1)


def approximate_visibility(horizon: Tensor, slope_x: Tensor, slope_y: Tensor) -> Tensor:
    """(batch, n, n) share of an unoccluded sky's light on faces of these slopes that horizons leave.

    Of light from a direction on a level matte face, the share above an elevation is its cosine squared.

    Args:
        horizon: (batch, WAYS, n, n) tangents.
    """
    slopes = torch.stack((slope_x, slope_y), 1).flatten(2)
    own = (_ways().to(slopes) @ slopes).view(horizon.shape).clamp_min(0.0)
    share: Tensor = _Share.apply(horizon, own)
    return share


@lru_cache(maxsize=1)
def _ways() -> Tensor:
    """(WAYS, 2) unit vectors of the ways, x and y."""
    return torch.tensor([(col / math.hypot(row, col), -row / math.hypot(row, col)) for row, col in WAYS])


class _Share(torch.autograd.Function):
    """Sum over ways of 1 / (1 + max(horizon, own)²) over that of 1 / (1 + own²)."""

    @staticmethod
    def forward(ctx: Any, horizon: Tensor, own: Tensor) -> Tensor:
        most = torch.maximum(horizon, own)
        left = most.square().add_(1.0).reciprocal_()
        whole = own.square().add_(1.0).reciprocal_()
        total = whole.sum(1)
        share = left.sum(1) / total
        ctx.save_for_backward(horizon, own, most, left, whole, total, share)
        return share

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, Tensor]:
        horizon, own, most, left, whole, total, share = ctx.saved_tensors
        scaled = (-2.0 * gradient / total)[:, None]
        by_most = most.mul(left).mul_(left).mul_(scaled)
        to_horizon = by_most * (horizon > own)
        by_whole = own.mul(whole).mul_(whole).mul_(scaled * share[:, None])
        return to_horizon, by_most.sub_(to_horizon).sub_(by_whole)


def inputs(heights: Tensor, size_mm: float, unoccluded: Tensor) -> Tensor:
    """Input maps (batch, CHANNELS, n, n) of the net, all of order 1; the first is the approximate visibility.

    Args:
        heights: (batch, n, n) mm.
        size_mm: side of the plate.
        unoccluded: (batch, n, n) radiance if nothing hid the sky; only its proportions count.
    """
    n = heights.shape[-1]
    lengths = heights * (n / size_mm)
    ring = functional.pad(lengths[:, None], (1, 1, 1, 1), mode="replicate")[:, 0]
    away = ((torch.arange(n, dtype=heights.dtype, device=heights.device) + 0.5) * (2.0 / n) - 1.0).abs()
    means = [_mean_around(lengths, reach) for reach in REACHES]
    slope_x = 0.5 * (ring[:, 1:-1, 2:] - ring[:, 1:-1, :-2])
    slope_y = 0.5 * (ring[:, :-2, 1:-1] - ring[:, 2:, 1:-1])
    horizon = horizons(lengths)
    return torch.stack(
        (
            approximate_visibility(horizon, slope_x, slope_y),
            functional.softsign(slope_x),
            functional.softsign(slope_y),
            *torch.atan(horizon).unbind(1),
            *(functional.softsign(lengths - mean) for mean in means),
            unoccluded / unoccluded.mean((-2, -1), keepdim=True) - 1.0,
            away.expand_as(heights),
            away[:, None].expand_as(heights),
        ),
        dim=-3,
    )


def _mean_around(lengths: Tensor, reach: int) -> Tensor:
    """Over squares of so many samples a side, without what lies beside the plate."""
    rows = _mean_of_row(lengths.shape[-1], reach).to(lengths)
    return rows @ lengths @ rows.T


@lru_cache(maxsize=8)
def _mean_of_row(n: int, reach: int) -> Tensor:
    """(n, n) matrix of running means."""
    place = torch.arange(n)
    near = ((place[:, None] - place).abs() <= reach // 2).float()
    return near / near.sum(1, keepdim=True)


def sky_visibility(net: nn.Module, maps: Tensor) -> Tensor:
    """(batch, n, n), not negative."""
    return maps[:, 0] * functional.softplus(net(maps)[:, 0] + OPEN)


@dataclass(frozen=True, eq=False)
class AmbientLight:
    """Ambient light on a plate.

    Attributes:
        table: of the material under the whole sky, with the light's own strength.
        net: in single precision.
    """

    table: BsdfTable
    net: UNet

    def visibility(self, heights: Tensor, size_mm: float, unoccluded: Tensor) -> Tensor:
        """(n, n) share of what an unoccluded sky would give; heights and radiance (n, n)."""
        maps = inputs(heights[None].float(), size_mm, unoccluded[None].float())
        return sky_visibility(self.net, maps)[0].to(heights.dtype)


def material_figures(table: BsdfTable) -> dict[str, float]:
    """How a material's radiance under the whole sky falls as a face tilts; all that the net knows of it."""
    angles = torch.tensor((0.0, *MATERIAL_ANGLES), dtype=table.values.dtype)
    radiance = table(torch.tan(angles), torch.zeros_like(angles))[0]
    falls = (radiance[1:] / radiance[0]).tolist()
    return {f"sky at {angle:g} rad": fall for angle, fall in zip(MATERIAL_ANGLES, falls, strict=True)}


def validity(table: BsdfTable, samples: int) -> dict[str, float]:
    """What a net of ambient light holds for, by name."""
    return {"samples": float(samples), **material_figures(table)}


def trained_ambient_light(table: BsdfTable, samples: int, folder: Path = FOLDER) -> AmbientLight:
    """Ambient light by the trained net that lies in a folder.

    Raises:
        InputError: there is no such net, or it holds for another material or another number of samples.
    """
    try:
        net, card = load_net(KIND, folder)
    except InputError as error:
        raise InputError(f"look.model: {error}") from error
    if (card.shape.inputs, card.shape.outputs) != (CHANNELS, 1):
        raise InputError(
            f"look.model: {folder}: shape: {card.shape.inputs} maps in and {card.shape.outputs} out, "
            f"expected {CHANNELS} and 1"
        )
    _check(card.valid, validity(table, samples))
    return AmbientLight(table, net)


def _check(trained: Mapping[str, float], asked: Mapping[str, float]) -> None:
    for name, value in asked.items():
        if name not in trained:
            raise InputError(f"look.model: the net's card does not tell its {name}")
        if abs(trained[name] - value) > (MATERIAL_TOLERANCE if name != "samples" else 0.0):
            what = "height samples a side" if name == "samples" else f"a material with {name}"
            raise InputError(
                f'look.model: the net is trained for {what} {trained[name]:.3g}, not {value:.3g}; use "exact"'
            )
