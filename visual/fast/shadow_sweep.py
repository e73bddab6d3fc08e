"""Shadows of parallel lights on a relief seen from straight above: one running maximum a light, and no ray.

Walk away from the light, and add to every height what the light's way has come down by then. A point is lit
exactly if nothing on the way was higher in that measure, and by how much it is higher, or lower, is its
*clearance*: zero on the boundary of the shadow, smooth across it, and differentiable by the heights, those of
the point and those of what it clears. Boundaries are cut through the triangles of the relief by the
clearance at their corners, so that the lit share of a pixel is continuous in the heights, and its gradient
follows the shadow.

Just behind a crest clearance jumps, from what the crest clears to nothing. The triangles there are turned
away from the light, and dark whatever their share.

The relief is that of the renderer, triangle by triangle. Two things are interpolated: the running maximum
between lines half a sample apart, and the height of what casts a shadow between columns half a sample apart.
What that costs stands in docs/learned.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

Index = NDArray[np.int64]

NOWHERE = -1e4
"""Height, mm, beside the plate: nothing there casts a shadow."""
ALL_ABOVE = 7
"""All three bits."""


def framed(heights: Tensor) -> Tensor:
    """(n + 2, n + 2): samples (n, n) and the ring around them, which repeats them (`relief.grid`)."""
    return functional.pad(heights[None, None], (1, 1, 1, 1), mode="replicate")[0, 0]


def refined(heights: Tensor) -> Tensor:
    """(2n + 1, 2n + 1) heights of the triangulated relief on the corners of all quarters of pixels.

    Sample (i, j) stands at (2i + 1, 2j + 1). Cells are cut in two from their upper right to their lower left.
    """
    ring, n = framed(heights), heights.shape[0]
    fine = heights.new_empty(2 * n + 1, 2 * n + 1)
    fine[1::2, 1::2] = heights
    fine[0::2, 1::2] = 0.5 * (ring[:-1, 1:-1] + ring[1:, 1:-1])
    fine[1::2, 0::2] = 0.5 * (ring[1:-1, :-1] + ring[1:-1, 1:])
    fine[0::2, 0::2] = 0.5 * (ring[:-1, 1:] + ring[1:, :-1])
    return fine


def slopes(heights: Tensor, size_mm: float) -> tuple[Tensor, Tensor]:
    """dz/dx and dz/dy, each (2, n + 1, n + 1): of the upper left and the lower right face of every cell."""
    ring, spacing = framed(heights), size_mm / heights.shape[0]
    right = (ring[:, 1:] - ring[:, :-1]) / spacing
    up = (ring[:-1, :] - ring[1:, :]) / spacing
    return torch.stack((right[:-1], right[1:])), torch.stack((up[:, :-1], up[:, 1:]))


@dataclass(frozen=True, eq=False)
class Sweep:
    """The lines along which one light is followed over a grid; they do not depend on the heights.

    Lines run toward the light, a column of corners a step, and begin a row of corners apart. Columns are
    counted from the light's side of the plate. In every column all lines cross between two corners in the
    same proportion, and all corners lie in the same proportion between two lines.

    Attributes:
        shear: (lines + 1, columns) corners beside which lines cross columns, as flat numbers, one past the
            last for nowhere; a line crosses between its own and the next.
        part: (columns,) weight of the next.
        rise: (columns,) mm by which the light's way lies lower there than at the first column.
        share: (columns,) weight of the next line for the corners of the next column.
        near: (corners,) the line before a corner, up to the column before its own, as flat numbers of
            (lines - 1, columns), one past the last for none: before the first column lies nothing.
        column: (corners,) that column.
        raised: (corners,) `rise` at corners, mm.
    """

    shear: Tensor
    part: Tensor
    rise: Tensor
    share: Tensor
    near: Tensor
    column: Tensor
    raised: Tensor

    def clearance(self, fine: Tensor) -> Tensor:
        """(m, m) mm by which corners of heights (m, m) stand above the shadow that falls there, or below."""
        return self.traced(fine)[0]

    def traced(self, fine: Tensor) -> tuple[Tensor, Tensor]:
        """Clearance, and (lines, columns) the column of what is highest up to each column of a line."""
        flat = fine.reshape(-1)
        nowhere = flat.new_full((1,), NOWHERE)
        crossed = torch.cat((flat, nowhere)).index_select(0, self.shear.view(-1)).view(self.shear.shape)
        lines = torch.lerp(crossed[:-1], crossed[1:], self.part).add_(self.rise)
        highest, where = lines.cummax(1)
        between = torch.lerp(highest[:-1], highest[1:], self.share).view(-1)
        cleared = torch.cat((between, nowhere)).index_select(0, self.near)
        return (flat + self.raised).sub_(cleared).view(fine.shape), where

    def shading(self, where: Tensor, corners: Tensor) -> tuple[Tensor, Tensor]:
        """What some corners (k,) must clear: (4, k) corners between which it lies, and their weights.

        Args:
            where: of `traced`.
        """
        lines, columns = where.shape
        near = self.near.index_select(0, corners)
        shaded = near < (lines - 1) * columns
        near, there = near * shaded, shaded.to(self.share.dtype)
        column = self.column.index_select(0, corners)
        share = self.share.index_select(0, column)
        found, weights = [], []
        for step, weight in ((0, there * (1.0 - share)), (1, there * share)):
            line = near + step * columns
            at = where.view(-1).index_select(0, line)
            part = weight * self.part.index_select(0, at)
            crossing = line - column + at
            found += [self.shear.view(-1).index_select(0, crossing + beside * columns) for beside in (0, 1)]
            weights += [weight - part, part]
        return torch.stack(found), torch.stack(weights)


@lru_cache(maxsize=32)
def sweep(samples: int, size_mm: float, toward: tuple[float, float, float], dtype: torch.dtype) -> Sweep:
    """The lines toward a light.

    Args:
        samples: height samples a side.
        toward: unit vector toward the light; not straight up.
    """
    side = 2 * samples + 1
    right, down = toward[0], -toward[1]
    transposed = abs(right) < abs(down)
    if transposed:
        right, down = down, right
    column = np.arange(side)
    place = column if right < 0.0 else side - 1 - column  # of the column in the grid
    slope = -down / abs(right)  # rows a column, away from the light
    spacing = size_mm / (side - 1)
    rise = toward[2] / math.hypot(toward[0], toward[1]) * math.hypot(1.0, slope) * spacing * column

    def corner(row: Index) -> Index:
        number = place * side + row if transposed else row * side + place
        return np.where((row >= 0) & (row < side), number, side * side)

    first = math.floor(-max(0.0, slope * (side - 1))) - 1
    last = math.ceil(side - 1 - min(0.0, slope * (side - 1))) + 1
    shift = np.floor(slope * column).astype(np.int64)
    shear = corner(np.arange(first, last + 2)[:, None] + shift)
    # A corner lies between the two lines that pass it in its own column.
    row, back = np.arange(side)[:, None], np.floor(-slope * column).astype(np.int64)
    near = (row + back - first) * side + column - 1
    near[:, 0] = (last - first) * side
    order = np.empty(side * side, dtype=np.int64)
    order[corner(np.broadcast_to(row, (side, side))).ravel()] = np.arange(side * side)

    def whole(values: Index) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values))

    def real(values: NDArray[Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values)).to(dtype)

    return Sweep(
        whole(shear),
        real(slope * column - shift),
        real(rise),
        real(np.append((-slope * column - back)[1:], 0.0)),
        whole(near.ravel()[order]),
        whole(np.broadcast_to(np.maximum(column - 1, 0), (side, side)).ravel()[order]),
        real(np.broadcast_to(rise, (side, side)).ravel()[order]),
    )


@dataclass(frozen=True, eq=False)
class Cuts:
    """Triangles of quarters of pixels that are partly in light, where clearance is linear on each.

    Attributes:
        triangle: (k,) flat numbers in (2, m - 1, m - 1): those at the upper left of all quarters, then those
            at the lower right.
        corners: (3, k) flat numbers in (m, m): the corner on its own side of the boundary, then the others.
        share: (k,) of the triangle that lies in light.
        by: (3, k) its derivative by the clearance of the corners, 1/mm.
    """

    triangle: Tensor
    corners: Tensor
    share: Tensor
    by: Tensor


def lit_shares(clearance: Tensor) -> tuple[Tensor, Cuts]:
    """(2, m - 1, m - 1) share of each triangle that lies in light, by the clearance (m, m) of its corners.

    Returns:
        The shares, and the triangles where they are neither 0 nor 1.
    """
    side = clearance.shape[0]
    above = (clearance > 0.0).numpy().view(np.uint8)
    # Which of its three corners stand above, as the bits of a number.
    code = np.stack((above[:-1, :-1], above[1:, 1:]))
    code += 2 * above[:-1, 1:]
    code += 4 * above[1:, :-1]
    triangle = np.flatnonzero((code - 1) < ALL_ABOVE - 1)
    kind = code.reshape(-1).take(triangle) + 8 * (triangle >= (side - 1) ** 2)
    corners = torch.from_numpy(
        _first_corners(side).take(triangle) + _steps_to_corners(side).take(kind, axis=1)
    )
    values = clearance.reshape(-1).index_select(0, corners.view(-1)).view(corners.shape)
    share, by = positive_part(values)
    number = torch.from_numpy(triangle)
    shares = torch.from_numpy(code == ALL_ABOVE).to(clearance.dtype)
    shares.view(-1).index_copy_(0, number, share)
    return shares, Cuts(number, corners, share, by)


@lru_cache(maxsize=4)
def _first_corners(side: int) -> Index:
    """Upper left corner of the quarter of every triangle, as flat numbers in (side, side)."""
    corner = np.arange(side * side).reshape(side, side)[:-1, :-1]
    return np.tile(corner.ravel(), 2)


@lru_cache(maxsize=4)
def _steps_to_corners(side: int) -> Index:
    """(3, 16) flat steps from there to the corner on its own side of the boundary, and to the others.

    By which corners stand above; those of the triangles at the lower right from 8 on.
    """
    alone = {1: 0, 6: 0, 2: 1, 5: 1, 4: 2, 3: 2}
    steps = np.zeros((3, 16), dtype=np.int64)
    for which, own in enumerate((0, side + 1)):
        corners = (own, 1, side)
        for code, odd in alone.items():
            steps[:, code + 8 * which] = corners[odd], corners[odd - 2], corners[odd - 1]
    return steps


def positive_part(values: Tensor) -> tuple[Tensor, Tensor]:
    """Share (k,) of triangles where a linear function is positive, and its derivatives (3, k).

    Args:
        values: (3, k) of the function at the corners; the first is positive where the others are not, or not
            where they are.
    """
    odd, left, right = values
    to_left, to_right = odd - left, odd - right
    # The boundary leaves the first corner a triangle: two ratios along two sides.
    small = (odd / to_left) * (odd / to_right)
    by_left, by_right = small / to_left, small / to_right
    by_odd = 2.0 * odd / (to_left * to_right) - by_left - by_right
    sign = (odd > 0.0).to(odd.dtype).mul_(2.0).sub_(1.0)
    return (0.5 - 0.5 * sign) + sign * small, sign * torch.stack((by_odd, by_left, by_right))


class _LitPicture(torch.autograd.Function):
    """A picture of faces under one light; only cut triangles know of the shadow's motion."""

    @staticmethod
    def forward(ctx: Any, fine: Tensor, faces: Tensor, way: Sweep) -> Tensor:
        clearance, where = way.traced(fine)
        shares, cuts = lit_shares(clearance)
        ctx.way, ctx.where, ctx.cuts = way, where, cuts
        ctx.save_for_backward(shares, faces)
        return pooled_faces(shares, faces)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        shares, faces = ctx.saved_tensors
        to_fine = to_faces = None
        if ctx.needs_input_grad[1]:
            to_faces = _to_faces(shares, gradient)
        if ctx.needs_input_grad[0]:
            way, cuts, n = ctx.way, ctx.cuts, gradient.shape[-1]
            pixel, face = (places.index_select(0, cuts.triangle) for places in _places(n))
            weight = 0.125 * gradient.reshape(-1).index_select(0, pixel)
            weight = weight * faces.reshape(-1).index_select(0, face)
            to_fine = faces.new_zeros((2 * n + 1) ** 2 + 1)
            to_fine.index_add_(0, cuts.corners.view(-1), (weight * cuts.by).view(-1))
            corners = torch.from_numpy(np.flatnonzero(to_fine.numpy()))
            shading, part = way.shading(ctx.where, corners)
            taken = part * to_fine.index_select(0, corners)
            to_fine.index_add_(0, shading.view(-1), taken.view(-1), alpha=-1)
            to_fine = to_fine[:-1].view(2 * n + 1, 2 * n + 1)
        return to_fine, to_faces, None


def lit_picture(fine: Tensor, faces: Tensor, way: Sweep | None) -> Tensor:
    """(n, n) picture of faces under one light, shadows included, differentiable by heights and radiance.

    Args:
        fine: (2n + 1, 2n + 1) of `refined`.
        faces: (2, n + 1, n + 1) their radiance where the light reaches them.
        way: the light's; None for one that casts no shadow.
    """
    if way is None:
        return pooled_faces(None, faces)
    picture: Tensor = _LitPicture.apply(fine, faces, way)
    return picture


def pooled_faces(shares: Tensor | None, faces: Tensor) -> Tensor:
    """(n, n) mean over each pixel of its faces (2, n + 1, n + 1), each triangle of a quarter with its share.

    Args:
        shares: (2, 2n, 2n); None for 1.
    """
    own = _own_faces(faces)
    if shares is None:
        return 0.125 * (2.0 * (own[0] + own[5]) + own[1] + own[2] + own[3] + own[4])
    first, *others = (share * face for share, face in zip(_pooled_shares(shares), own, strict=True))
    return 0.125 * sum(others, first)


def _own_faces(faces: Tensor) -> tuple[Tensor, ...]:
    """(n, n) views of the six faces that pixels see: first and last fill a quarter, the others half."""
    first, second = faces
    return second[:-1, :-1], first[:-1, 1:], second[:-1, 1:], first[1:, :-1], second[1:, :-1], first[1:, 1:]


def _pooled_shares(shares: Tensor) -> tuple[Tensor, ...]:
    """(n, n) shares of those six faces."""
    one, two = shares
    return (
        one[0::2, 0::2] + two[0::2, 0::2],
        one[0::2, 1::2],
        two[0::2, 1::2],
        one[1::2, 0::2],
        two[1::2, 0::2],
        one[1::2, 1::2] + two[1::2, 1::2],
    )


def _to_faces(shares: Tensor, gradient: Tensor) -> Tensor:
    """(2, n + 1, n + 1): the transpose of `pooled_faces` for its second argument."""
    gradient, n = 0.125 * gradient, gradient.shape[-1]
    both = gradient.new_zeros(2, n + 1, n + 1)
    for share, face in zip(_pooled_shares(shares), _own_faces(both), strict=True):
        face.addcmul_(share, gradient)
    return both


@lru_cache(maxsize=4)
def _places(n: int) -> tuple[Tensor, Tensor]:
    """(8 n²,) flat numbers of the pixel and of the face of every triangle of `lit_shares`."""
    half = torch.arange(2 * n).div(2, rounding_mode="floor")
    pixel = (half[:, None] * n + half).expand(2, 2 * n, 2 * n)
    face = of_quarters(torch.arange(2 * (n + 1) ** 2).view(2, n + 1, n + 1))
    return pixel.reshape(-1), face.reshape(-1)


def of_quarters(faces: Tensor) -> Tensor:
    """(..., 2, 2n, 2n) values of triangles of quarters of pixels, of faces (..., 2, n + 1, n + 1)."""
    n = faces.shape[-1] - 1
    first, second = faces.unbind(-3)
    fine = faces.new_empty(*faces.shape[:-2], 2 * n, 2 * n)
    fine[..., 0::2, 0::2] = second[..., None, :-1, :-1]
    fine[..., 0, 0::2, 1::2] = first[..., :-1, 1:]
    fine[..., 1, 0::2, 1::2] = second[..., :-1, 1:]
    fine[..., 0, 1::2, 0::2] = first[..., 1:, :-1]
    fine[..., 1, 1::2, 0::2] = second[..., 1:, :-1]
    fine[..., 1::2, 1::2] = first[..., None, 1:, 1:]
    return fine


def shown(triangles: Tensor) -> Tensor:
    """(..., 2n, 2n) of quarters of pixels, each of which is two triangles (..., 2, 2n, 2n) of equal size."""
    return triangles.mean(-3)


def pooled(quarters: Tensor) -> Tensor:
    """(..., n, n): a pixel is four quarters (..., 2n, 2n)."""
    side = quarters.shape[-1] // 2
    return quarters.view(*quarters.shape[:-2], side, 2, side, 2).mean((-3, -1))
