"""Horizons of a relief: elevations above which rays from points of the surface are free, found exactly.

A ray is free if it is steeper than every line from its start to a farther point of the surface below the ray.
This section of the surface is a chain of straight pieces, so the steepest line ends where the section crosses
an edge of the mesh. Edges are of three families (columns, rows, diagonals), and each family is traversed on
its own. No ray is traced, nothing is sampled.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.backend.mitsuba import dr, mi

NEAREST_MM = 1e-5
"""Least distance of edges, mm: a point lies on nearer ones, which belong to the point's own face."""
PARALLEL_RATE = 1e-9
"""Least speed, samples per mm, across a family of edges: slower directions never meet one."""


def horizon_tangent(heights: Array, size_mm: float, x: Any, y: Any, z: Any, across: Any, up: Any) -> Any:
    """Tangent of the horizon's elevation, the largest dz / distance, of points along one direction each.

    A ring half a sample wide carries the outermost heights to the sides of the plate, where the plate ends.

    Args:
        heights: (rows, cols) mm.
        x, y, z: Dr.Jit arrays, mm, of points on the relief, not on its rim.
        across, up: Dr.Jit arrays, x and y of horizontal unit vectors.

    Returns:
        Dr.Jit array, negative where all of the plate lies below; without the face on which a point lies.
    """
    rows, cols = heights.shape
    table = mi.Float(heights.astype(np.float32).ravel())
    highest = float(heights.max())

    def at(row: Any, col: Any) -> Any:
        place = dr.clip(row, 0, rows - 1) * cols + dr.clip(col, 0, cols - 1)
        return dr.gather(mi.Float, table, mi.UInt32(place))

    # Positions count samples, rightward and down; `right` and `down` are samples per mm of distance.
    col, row = (x / size_mm + 0.5) * cols - 0.5, (0.5 - y / size_mm) * rows - 0.5
    right, down = across * (cols / size_mm), -up * (rows / size_mm)

    def distance_to_side(place: Any, rate: Any, samples: int) -> Any:
        beyond = dr.select(rate > 0.0, samples - 0.5 - place, place + 0.5)
        return beyond / dr.maximum(dr.abs(rate), PARALLEL_RATE)

    reach = dr.maximum(
        dr.minimum(distance_to_side(col, right, cols), distance_to_side(row, down, rows)), NEAREST_MM
    )

    def steepest_crossing(place: Any, rate: Any, height: Callable[[Any, Any], Any], rise: Any) -> Any:
        """The larger of `rise` and the rises to the points at which `place`, growing by `rate`, is whole."""
        speed = dr.maximum(dr.abs(rate), PARALLEL_RATE)
        ahead = dr.select(rate > 0.0, dr.floor(place) + 1.0, dr.ceil(place) - 1.0)

        def goes_on(distance: Any, line: Any, best: Any) -> Any:
            # Nothing is higher than the highest sample, so farther points cannot be steeper than that height.
            return (distance < reach) & (highest - z > best * distance)

        def step(distance: Any, line: Any, best: Any) -> tuple[Any, Any, Any]:
            crossing = (height(line, distance) - z) / distance
            better = dr.select(distance > NEAREST_MM, dr.maximum(best, crossing), best)
            return distance + 1.0 / speed, line + dr.sign(rate), better

        return dr.while_loop((dr.abs(ahead - place) / speed, ahead, rise), goes_on, step)[2]

    def lerp(part: Any, first: Any, second: Any) -> Any:
        return first + part * (second - first)

    def on_column(line: Any, distance: Any) -> Any:
        place = row + distance * down
        below, j = mi.Int32(dr.floor(place)), mi.Int32(line)
        return lerp(place - mi.Float(below), at(below, j), at(below + 1, j))

    def on_row(line: Any, distance: Any) -> Any:
        place = col + distance * right
        below, i = mi.Int32(dr.floor(place)), mi.Int32(line)
        return lerp(place - mi.Float(below), at(i, below), at(i, below + 1))

    def on_diagonal(line: Any, distance: Any) -> Any:
        place = col + distance * right
        below = mi.Int32(dr.floor(place))
        i = mi.Int32(line) - below
        return lerp(place - mi.Float(below), at(i, below), at(i - 1, below + 1))

    # The section ends at the side of the plate, on the ring.
    end_row, end_col = row + reach * down, col + reach * right
    i, j = mi.Int32(dr.floor(end_row)), mi.Int32(dr.floor(end_col))
    u, v = end_col - mi.Float(j), end_row - mi.Float(i)
    rim = lerp(v, lerp(u, at(i, j), at(i, j + 1)), lerp(u, at(i + 1, j), at(i + 1, j + 1)))
    rise = (rim - z) / reach
    rise = steepest_crossing(col, right, on_column, rise)
    rise = steepest_crossing(row, down, on_row, rise)
    return steepest_crossing(row + col, right + down, on_diagonal, rise)
