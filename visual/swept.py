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

NOWHERE = -1e4
"""Height, mm, beside the plate: nothing there casts a shadow."""
DENSITY = 1
"""Lines a row of corners. Pictures of gravel err by 1.9 % of their mean with 1, 1.6 with 2, 1.5 with 4."""


def framed(heights: Tensor) -> Tensor:
    """(n + 2, n + 2): samples (n, n) and the ring around them, which repeats them (`visual.mesh`)."""
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
    counted from the light's side of the plate.

    Attributes:
        below, above: (lines, columns) corners between which a line crosses a column, as flat numbers; one
            past the last for nowhere.
        part: (lines, columns) weight of the corners above.
        rise: (columns,) mm by which the light's way lies lower there than at the first column.
        before, after: (corners,) the two lines beside a corner, up to the column before its own, as flat
            numbers of (lines, columns + 1): before the first column lies nothing.
        share: (corners,) weight of `after`.
        raised: (corners,) `rise` at corners, mm.
    """

    below: Tensor
    above: Tensor
    part: Tensor
    rise: Tensor
    before: Tensor
    after: Tensor
    share: Tensor
    raised: Tensor

    def clearance(self, fine: Tensor) -> Tensor:
        """(m, m) mm by which corners of heights (m, m) stand above the shadow that falls there, or below."""
        return self.traced(fine)[0]

    def traced(self, fine: Tensor) -> tuple[Tensor, Tensor]:
        """Clearance, and (lines, columns) the column of what is highest up to each column of a line."""
        flat = fine.reshape(-1)
        known = torch.cat((flat, flat.new_full((1,), NOWHERE)))
        lines = torch.lerp(known[self.below], known[self.above], self.part) + self.rise
        highest, where = lines.cummax(1)
        highest = functional.pad(highest, (1, 0), value=NOWHERE).reshape(-1)
        cleared = torch.lerp(highest[self.before], highest[self.after], self.share)
        return (flat + self.raised - cleared).view(fine.shape), where


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

    def corner(row: NDArray[np.int64]) -> NDArray[np.int64]:
        number = place * side + row if transposed else row * side + place
        return np.where((row >= 0) & (row < side), number, side * side)

    first = math.floor(DENSITY * -max(0.0, slope * (side - 1))) - 1
    last = math.ceil(DENSITY * (side - 1 - min(0.0, slope * (side - 1)))) + 1
    crossing = np.arange(first, last + 1)[:, None] / DENSITY + slope * column
    below = np.floor(crossing).astype(np.int64)
    # A corner lies between the two lines that pass it in its own column.
    row = np.arange(side)[:, None]
    between = DENSITY * (row - slope * column) - first
    before = np.floor(between).astype(np.int64)
    order = np.empty(side * side, dtype=np.int64)
    order[corner(np.broadcast_to(row, (side, side))).ravel()] = np.arange(side * side)

    def whole(values: NDArray[np.int64]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values))

    def real(values: NDArray[Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values)).to(dtype)

    near = (before * (side + 1) + column).ravel()[order]
    return Sweep(
        whole(corner(below)),
        whole(corner(below + 1)),
        real(crossing - below),
        real(rise),
        whole(near),
        whole(near + side + 1),
        real((between - before).ravel()[order]),
        real(np.broadcast_to(rise, (side, side)).ravel()[order]),
    )


def lit_shares(clearance: Tensor) -> Tensor:
    """(2, m - 1, m - 1) share of each triangle that lies in light, by the clearance (m, m) of its corners.

    First the triangles at the upper left of each quarter of a pixel, then those at the lower right. Clearance
    is linear on each; what of it is positive has a closed form.
    """
    cut, corners = cut_triangles(clearance)
    first, second, third = clearance.reshape(-1)[corners]
    share = (_corners_above(clearance) == 3).to(clearance.dtype)
    return share.index_put(cut, positive_part(first, second, third))


def cut_triangles(clearance: Tensor) -> tuple[tuple[Tensor, Tensor, Tensor], Tensor]:
    """Triangles partly in light: places (2, m - 1, m - 1), and corners (3, cut) as flat numbers."""
    count, side = _corners_above(clearance), clearance.shape[0]
    which, row, col = torch.nonzero((count == 1) | (count == 2), as_tuple=True)
    own = (row + which) * side + col + which
    return (which, row, col), torch.stack((own, row * side + col + 1, (row + 1) * side + col))


def _corners_above(clearance: Tensor) -> Tensor:
    above = (clearance.detach() > 0.0).to(torch.uint8)
    return torch.stack((above[:-1, :-1], above[1:, 1:])) + above[:-1, 1:] + above[1:, :-1]


def positive_part(first: Tensor, second: Tensor, third: Tensor) -> Tensor:
    """Share of a triangle where a linear function is positive that is so at one or two of its corners."""
    one, two, three = first > 0.0, second > 0.0, third > 0.0
    # The corner on its own side of the cut, which leaves it a triangle: two ratios along two sides.
    odd = torch.where(two == three, first, torch.where(one == three, second, third))
    left = torch.where(two == three, second, first)
    right = torch.where(one == two, second, third)
    small = (odd / (odd - left)) * (odd / (odd - right))
    return torch.where(odd > 0.0, small, 1.0 - small)


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
