"""Shadow sweep: shadows of a parallel light on a relief seen from straight above, by a running maximum.

Traverse the grid away from the light. Add to the height z of each point the drop of a light ray since the
start; with elevation e of the light and horizontal distance s from the first column,

    q(s) = z(s) + s tan e,        clearance(s) = q(s) - max of q(s') over s' < s.

A point is lit if its clearance is positive. Clearance is zero on the boundary of a shadow, smooth across the
boundary, and differentiable by the height of the point and by that of the point which casts the shadow. Just
behind a crest clearance jumps; the faces there are turned away from the light and dark at any clearance.

The heights are those of the renderer's triangles. Two quantities are interpolated: the running maximum
between lines half a sample apart, and heights between the corners of a column half a sample apart.
docs/evidence/speed.md has the errors.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.ground.arrays import Index
from relief.plate_grid import NO_HALO, Halo
from relief.surface import Surface

OUTSIDE_MM = -1e4
"""Height beyond the plate, mm: so low that nothing there casts a shadow."""


@dataclass(frozen=True, eq=False)
class ShadowSweep:
    """Lines along which shadows of one light fall on a grid of corners (p, q), whatever their heights.

    Lines run along the light's azimuth and begin a row of corners apart. A step along a line is one column of
    corners; columns are counted from the light's side of the plate. All lines cross a column in the same
    proportion between two corners, and all corners of a column lie in the same proportion between two lines.

    Attributes:
        crossed: (lines + 1, columns) flat number of the corner before which a line crosses a column, p q
            beyond the grid; the crossing lies between the line's own corner and the next line's.
        corner_weight: (columns,) weight of the latter of these corners.
        drop: (columns,) mm by which a light ray lies lower at a column than at the first.
        line_weight: (columns,) for the corners of the following column, weight of the latter of their lines.
        previous: (corners,) flat number in (lines - 1, columns) of the former of a corner's lines, at the
            column before the corner's own; one past the last for corners of the first column.
        column: (corners,) that column.
        corner_drop: (corners,) `drop` at the corner's own column.
    """

    crossed: Tensor
    corner_weight: Tensor
    drop: Tensor
    line_weight: Tensor
    previous: Tensor
    column: Tensor
    corner_drop: Tensor

    def trace(self, fine: Tensor) -> tuple[Tensor, Tensor]:
        """Clearance of corners, and the columns of the running maximum.

        Args:
            fine: (p, q) mm, heights of the corners.

        Returns:
            (p, q) clearance, mm, positive in light and negative in shadow; and (lines, columns) the column of
            the running maximum at each column of a line.
        """
        flat = fine.reshape(-1)
        outside = flat.new_full((1,), OUTSIDE_MM)
        crossed = torch.cat((flat, outside)).index_select(0, self.crossed.view(-1)).view(self.crossed.shape)
        lines = torch.lerp(crossed[:-1], crossed[1:], self.corner_weight).add_(self.drop)
        highest, highest_column = lines.cummax(1)
        between = torch.lerp(highest[:-1], highest[1:], self.line_weight).view(-1)
        cleared = torch.cat((between, outside)).index_select(0, self.previous)
        return (flat + self.corner_drop).sub_(cleared).view(fine.shape), highest_column

    def occluders(self, highest_column: Tensor, corners: Tensor) -> tuple[Tensor, Tensor]:
        """Corners whose heights make the running maximum that some corners must clear.

        Args:
            highest_column: second result of `trace`.
            corners: (k,) flat numbers.

        Returns:
            (4, k) flat numbers, p q beyond the grid, and (4, k) their weights: minus the derivatives of the
            clearance of `corners`.
        """
        lines, columns = highest_column.shape
        previous = self.previous.index_select(0, corners)
        preceded = previous < (lines - 1) * columns
        previous, weight = previous * preceded, preceded.to(self.line_weight.dtype)
        column = self.column.index_select(0, corners)
        line_weight = self.line_weight.index_select(0, column)
        numbers, weights = [], []
        for step, of_line in ((0, weight * (1.0 - line_weight)), (1, weight * line_weight)):
            line = previous + step * columns
            highest = highest_column.view(-1).index_select(0, line)
            latter = of_line * self.corner_weight.index_select(0, highest)
            crossing = line - column + highest
            numbers += [
                self.crossed.view(-1).index_select(0, crossing + beside * columns) for beside in (0, 1)
            ]
            weights += [of_line - latter, latter]
        return torch.stack(numbers), torch.stack(weights)


@lru_cache(maxsize=32)
def shadow_sweep(
    surface: Surface, toward: tuple[float, float, float], dtype: torch.dtype, halo: Halo = NO_HALO
) -> ShadowSweep:
    """The shadow sweep of a light over the corners of quarters of pixels.

    On an axis that repeats, a line goes on through the neighbours: it crosses their corners, which are those
    of the plate once more. Along the columns the line begins in the halo.

    Args:
        surface: of r x c height samples; there are (2r + 1) (2c + 1) corners.
        toward: unit vector toward the light, not straight up.
        dtype: of weights and lengths.
        halo: samples of the neighbours along y and x whose shadows reach the plate.
    """
    down_side, across_side = (2 * n + 1 for n in surface.shape)
    right, down = toward[0], -toward[1]
    transposed = abs(right) < abs(down)
    side, crossing, axis = across_side, down_side, 1
    if transposed:
        right, down = down, right
        side, crossing, axis = down_side, across_side, 0
    before = 2 * halo[axis] if surface.repeats[axis] else 0
    column = np.arange(before + side)
    columns = len(column)
    grid_column = column - before if right < 0.0 else before + side - 1 - column
    grid_column[:before] %= side - 1
    slope = -down / abs(right)  # rows a column, away from the light
    spacing = 0.5 * surface.pitch_mm
    drop = toward[2] / math.hypot(toward[0], toward[1]) * math.hypot(1.0, slope) * spacing * column

    def corner(row: Index, grid_column: Index) -> Index:
        inside = (row >= 0) & (row < crossing)
        if surface.repeats[1 - axis]:
            row, inside = np.where(inside, row, row % (crossing - 1)), np.ones_like(inside)
        number = grid_column * crossing + row if transposed else row * side + grid_column
        return np.where(inside, number, side * crossing)

    # Lines that pass the plate's own corners, which lie in the last columns.
    shifts = (-slope * column[before], -slope * column[-1])
    first = math.floor(min(shifts)) - 1
    last = math.ceil(crossing - 1 + max(shifts)) + 1
    shift = np.floor(slope * column).astype(np.int64)
    crossed = corner(np.arange(first, last + 2)[:, None] + shift, grid_column)
    # A corner lies between the two lines that pass it in its own column.
    row, back = np.arange(crossing)[:, None], np.floor(-slope * column).astype(np.int64)
    previous = (row + back - first) * columns + column - 1
    previous[:, 0] = (last - first) * columns
    own, shape = slice(before, None), (crossing, side)
    order = np.empty(side * crossing, dtype=np.int64)
    order[corner(np.broadcast_to(row, shape), grid_column[own]).ravel()] = np.arange(side * crossing)

    def whole(values: Index) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values))

    def real(values: NDArray[Any]) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values)).to(dtype)

    return ShadowSweep(
        whole(crossed),
        real(slope * column - shift),
        real(drop),
        real(np.append((-slope * column - back)[1:], 0.0)),
        whole(previous[:, own].ravel()[order]),
        whole(np.broadcast_to(np.maximum(column - 1, 0)[own], shape).ravel()[order]),
        real(np.broadcast_to(drop[own], shape).ravel()[order]),
    )
