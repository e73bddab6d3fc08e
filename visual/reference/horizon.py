"""Horizons of a relief: how high the rest of the plate stands before each point, all along a direction.

A ray from a point of a height field is free exactly if it rises more steeply than the line from the point to
anything farther along it. Along a ray the triangulation is a chain of straight lines, so the steepest of
those lines leads to a place where the ray crosses an edge of the mesh: there are three families of edges, and
each is walked on its own. No ray is traced, nothing is sampled.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

NEAREST_MM = 1e-5
"""Edges nearer than this are those that a point lies on; the slope of its own face tells of them."""
LEVEL = 1e-9
"""A direction changes by less than this many pixels a mm across edges that it never meets."""


def horizon_tangent(heights: Array, size_mm: float, x: Any, y: Any, z: Any, across: Any, up: Any) -> Any:
    """Largest dz / distance from points of the relief to any other point of it, each along its own direction.

    A ring half a sample wide around the samples carries the outermost heights to the plate's sides, where the
    plate ends: beyond there is nothing to see.

    Args:
        heights: (rows, cols) mm.
        x, y, z: Dr.Jit arrays, mm, of points on the relief, not on its rim.
        across, up: Dr.Jit arrays, x and y of horizontal unit vectors.

    Returns:
        Dr.Jit array, tangent of the horizon's elevation, negative where all of the plate lies below; without
        the face that a point lies on.
    """
    import drjit as dr
    import mitsuba as mi

    rows, cols = heights.shape
    table = mi.Float(heights.astype(np.float32).ravel())
    highest = float(heights.max())

    def at(row: Any, col: Any) -> Any:
        place = dr.clip(row, 0, rows - 1) * cols + dr.clip(col, 0, cols - 1)
        return dr.gather(mi.Float, table, mi.UInt32(place))

    # Positions count samples, rightward and down, and so does the way along the direction, a mm.
    col, row = (x / size_mm + 0.5) * cols - 0.5, (0.5 - y / size_mm) * rows - 0.5
    right, down = across * (cols / size_mm), -up * (rows / size_mm)

    def room(place: Any, rate: Any, samples: int) -> Any:
        beyond = dr.select(rate > 0.0, samples - 0.5 - place, place + 0.5)
        return beyond / dr.maximum(dr.abs(rate), LEVEL)

    reach = dr.maximum(dr.minimum(room(col, right, cols), room(row, down, rows)), NEAREST_MM)

    def climb(place: Any, rate: Any, height: Callable[[Any, Any], Any], rise: Any) -> Any:
        """The steepest rise to where `place`, that grows by `rate` a mm, is a whole number."""
        speed = dr.maximum(dr.abs(rate), LEVEL)
        ahead = dr.select(rate > 0.0, dr.floor(place) + 1.0, dr.ceil(place) - 1.0)

        def walking(distance: Any, line: Any, best: Any) -> Any:
            # No higher than the highest sample: what is farther cannot be steeper than that.
            return (distance < reach) & (highest - z > best * distance)

        def step(distance: Any, line: Any, best: Any) -> tuple[Any, Any, Any]:
            found = (height(line, distance) - z) / distance
            better = dr.select(distance > NEAREST_MM, dr.maximum(best, found), best)
            return distance + 1.0 / speed, line + dr.sign(rate), better

        return dr.while_loop((dr.abs(ahead - place) / speed, ahead, rise), walking, step)[2]

    def between(part: Any, first: Any, second: Any) -> Any:
        return first + part * (second - first)

    def on_column(line: Any, distance: Any) -> Any:
        place = row + distance * down
        below, j = mi.Int32(dr.floor(place)), mi.Int32(line)
        return between(place - mi.Float(below), at(below, j), at(below + 1, j))

    def on_row(line: Any, distance: Any) -> Any:
        place = col + distance * right
        below, i = mi.Int32(dr.floor(place)), mi.Int32(line)
        return between(place - mi.Float(below), at(i, below), at(i, below + 1))

    def on_diagonal(line: Any, distance: Any) -> Any:
        place = col + distance * right
        below = mi.Int32(dr.floor(place))
        i = mi.Int32(line) - below
        return between(place - mi.Float(below), at(i, below), at(i - 1, below + 1))

    # Where the plate ends: on the ring, whose heights are those of the outermost samples.
    end_row, end_col = row + reach * down, col + reach * right
    i, j = mi.Int32(dr.floor(end_row)), mi.Int32(dr.floor(end_col))
    u, v = end_col - mi.Float(j), end_row - mi.Float(i)
    rim = between(v, between(u, at(i, j), at(i, j + 1)), between(u, at(i + 1, j), at(i + 1, j + 1)))
    rise = (rim - z) / reach
    rise = climb(col, right, on_column, rise)
    rise = climb(row, down, on_row, rise)
    return climb(row + col, right + down, on_diagonal, rise)
