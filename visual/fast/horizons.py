"""Horizons of a relief in eight directions, sampled at a few distances, and the sky visibility they leave.

    tangent(x, d) = max over distances r of  (z(x + r d) - z(x)) / r,   at least 0

Both functions have their derivatives in closed form.
"""

import math
from functools import lru_cache
from typing import Any

import torch
from torch import Tensor
from torch.nn import functional

DIRECTIONS = ((0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0), (1, 1))
"""Rows and columns of one step in each direction; the second half is opposite to the first."""
DISTANCES = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
"""Distances, in steps, at which heights are compared; dense where a horizon changes fast."""
REACH = max(DISTANCES)
DISTANCE_MASK = 15
"""Mask of the float32 mantissa bits that hold the distance index; clearing them changes a tangent by at most
2e-6 of its value."""
LEVEL_TANGENT = 1e-6
"""Least tangent of a horizon: lower rises count as level and have no gradient."""
OUTSIDE = -1e4
"""Height beyond the plate, in samples: lower than any horizon."""


def horizons(lengths: Tensor, repeats: tuple[bool, bool] = (False, False)) -> Tensor:
    """Tangents of the horizons' elevation, not negative.

    Args:
        lengths: (batch, r, c) heights in units of the distance between samples.
        repeats: whether the same heights go on along y and x; nothing stands beyond an axis that ends.

    Returns:
        (batch, DIRECTIONS, r, c); in single precision whatever that of `lengths`.
    """
    outer = _surrounded(lengths.float(), repeats).contiguous()
    tangents: Tensor = _Horizons.apply(outer)
    return tangents.to(lengths.dtype)


def _surrounded(lengths: Tensor, repeats: tuple[bool, bool]) -> Tensor:
    """Lengths (batch, r + 2 REACH, c + 2 REACH) with `REACH` samples of what lies beyond each side."""
    for axis, wraps in zip((1, 2), repeats, strict=True):
        if wraps:
            n = lengths.shape[axis]
            place = torch.arange(-REACH, n + REACH, device=lengths.device) % n
            lengths = lengths.index_select(axis, place)
    down, across = (0 if wraps else REACH for wraps in repeats)
    return functional.pad(lengths, (across, across, down, down), value=OUTSIDE)


class _Horizons(torch.autograd.Function):
    """Tangents by lengths with all that lies around them, with their derivative.

    The distance index of each horizon, needed only by the backward pass, is stored in the low four mantissa
    bits of its tangent.
    """

    @staticmethod
    def forward(ctx: Any, outer: Tensor) -> Tensor:
        tracked, half = ctx.needs_input_grad[0], len(DIRECTIONS) // 2
        height, width = outer.shape[-2:]
        lengths = outer[:, REACH : height - REACH, REACH : width - REACH].contiguous()
        # Two opposite directions at once: their samples differ by a fixed step in memory.
        steepest = lengths.new_full((half, 2, *lengths.shape), LEVEL_TANGENT)
        steepest.view(torch.int32).bitwise_and_(~DISTANCE_MASK)
        rise = torch.empty_like(steepest[0])
        bits, middle = rise.view(torch.int32), REACH * (width + 1)
        for (row, col), most in zip(DIRECTIONS[:half], steepest, strict=True):
            for index, distance in enumerate(DISTANCES, 1):
                away = distance * abs(row * width + col)
                there = outer.as_strided(rise.shape, (2 * away, height * width, width, 1), middle - away)
                torch.sub(there, lengths, out=rise)
                rise.mul_(1.0 / (distance * math.hypot(row, col)))
                if tracked:
                    bits.bitwise_and_(~DISTANCE_MASK).bitwise_or_(index)
                torch.maximum(most, rise, out=most)
            if row * width + col > 0:
                most.copy_(most.flip(0))
        steepest = steepest.transpose(0, 1).reshape(len(DIRECTIONS), *lengths.shape)
        if tracked:
            ctx.save_for_backward(steepest)
        return steepest.transpose(0, 1)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> Tensor:
        (steepest,) = ctx.saved_tensors
        items, rows, cols = steepest.shape[1:]
        height, width = rows + 2 * REACH, cols + 2 * REACH
        device = gradient.device
        direction = torch.arange(len(DIRECTIONS), device=device)[:, None, None, None] * (DISTANCE_MASK + 1)
        step = (steepest.view(torch.int32).bitwise_and(DISTANCE_MASK) + direction).view(-1)
        per_length, offset = (values.to(device) for values in _steps(width))
        by_rise = gradient.transpose(0, 1) * per_length.index_select(0, step).view(steepest.shape)
        row, col = (torch.arange(n, device=device) + REACH for n in (rows, cols))
        item = torch.arange(items, device=device)[:, None, None] * (height * width)
        own = item + row[:, None] * width + col
        there = own + offset.index_select(0, step).view(steepest.shape)
        to_outer = gradient.new_zeros(items * height * width)
        to_outer.index_add_(0, there.view(-1), by_rise.reshape(-1))
        to_outer = to_outer.view(items, height, width)
        to_outer[:, REACH : REACH + rows, REACH : REACH + cols] -= by_rise.sum(0)
        return to_outer


@lru_cache(maxsize=4)
def _steps(width: int) -> tuple[Tensor, Tensor]:
    """Inverse length and offset in a flat map of every step, each (DIRECTIONS * (DISTANCE_MASK + 1),).

    Steps are numbered by direction, then by distance index; both are 0 at index 0, that of a level horizon.
    """
    shape = len(DIRECTIONS), DISTANCE_MASK + 1
    per_length, offset = torch.zeros(shape), torch.zeros(shape, dtype=torch.int64)
    for direction, (row, col) in enumerate(DIRECTIONS):
        for index, distance in enumerate(DISTANCES, 1):
            per_length[direction, index] = 1.0 / (distance * math.hypot(row, col))
            offset[direction, index] = distance * (row * width + col)
    return per_length.view(-1), offset.view(-1)


def approximate_visibility(tangents: Tensor, slope_x: Tensor, slope_y: Tensor) -> Tensor:
    """Share of a uniform sky's light that horizons leave a face, as if the face were level and matte.

    From one azimuth, the light above elevation e is the share cos² e = 1 / (1 + tan² e) of the irradiance.
    The share left is the sum over directions of cos² of the horizon over that of the face's own plane.

    Args:
        tangents: (batch, DIRECTIONS, r, c) of the horizons.
        slope_x, slope_y: (batch, r, c) dz/dx and dz/dy of the faces.

    Returns:
        (batch, r, c) in (0, 1].
    """
    slopes = torch.stack((slope_x, slope_y), 1).flatten(2)
    own = (_unit_directions().to(slopes) @ slopes).view(tangents.shape).clamp_min(0.0)
    share: Tensor = _VisibleShare.apply(tangents, own)
    return share


@lru_cache(maxsize=1)
def _unit_directions() -> Tensor:
    """(DIRECTIONS, 2) unit vectors, x and y."""
    return torch.tensor(
        [(col / math.hypot(row, col), -row / math.hypot(row, col)) for row, col in DIRECTIONS]
    )


class _VisibleShare(torch.autograd.Function):
    """Sum over directions of 1 / (1 + max(horizon, own)²) over the sum of 1 / (1 + own²)."""

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
