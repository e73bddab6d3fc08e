"""Where a camera sees what: its rays, its projection, and how the projection changes from point to point.

Film coordinates are pixels (column, row), from the upper left corner of the picture to the right and down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Projection:
    """An orthographic or perspective camera.

    Attributes:
        rows, cols: of the picture.
        perspective: whether its rays start from one point.
        origin: (3,) mm: that point, or the upper left corner of the film if the rays are parallel.
        across, down: (3,) one pixel to the right and down: mm if rays are parallel, else a change of
            direction.
        along: (3,) direction of parallel rays, unit; else of the ray through the upper left corner.
        overhead: whether it looks straight down on a plate that fills its picture.
    """

    rows: int
    cols: int
    perspective: bool
    origin: Array
    across: Array
    down: Array
    along: Array
    overhead: bool

    @property
    def pixels(self) -> int:
        """How many the picture has."""
        return self.rows * self.cols

    @cached_property
    def _inverse(self) -> Array:
        return np.linalg.inv(np.stack((self.across, self.down, self.along), axis=1))

    def rays(self, film: Array) -> tuple[Array, Array]:
        """Origins (mm) and unit directions of the rays through film points (points, 2); each (points, 3)."""
        spread = film[:, :1] * self.across + film[:, 1:] * self.down
        if self.perspective:
            directions = spread + self.along
            directions /= np.linalg.norm(directions, axis=1, keepdims=True)
            return np.broadcast_to(self.origin, directions.shape), directions
        return self.origin + spread, np.broadcast_to(self.along, spread.shape)

    def project(self, points: Array) -> Array:
        """Film coordinates (points, 2) of points (points, 3), mm."""
        place = (points - self.origin) @ self._inverse.T
        return place[:, :2] / place[:, 2:] if self.perspective else place[:, :2]

    def jacobian(self, points: Array) -> Array:
        """(points, 2, 3) pixels per mm."""
        inverse = self._inverse
        if not self.perspective:
            return np.broadcast_to(inverse[:2], (len(points), 2, 3))
        place = (points - self.origin) @ inverse.T
        film = place[:, :2] / place[:, 2:]
        return np.asarray((inverse[:2] - film[:, :, None] * inverse[2]) / place[:, 2, None, None])

    def toward(self, points: Array) -> Array:
        """Unit vectors (points, 3) from points to the camera."""
        if not self.perspective:
            return np.broadcast_to(-self.along, points.shape)
        away = self.origin - points
        return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))

    def pixel(self, film: Array) -> Index:
        """Number of the pixel, row by row, that film points (points, 2) lie in; -1 beyond the picture."""
        col, row = np.floor(film).astype(np.int64).T
        inside = (col >= 0) & (col < self.cols) & (row >= 0) & (row < self.rows)
        return np.where(inside, row * self.cols + col, -1)


def from_above(size_mm: float, resolution: int) -> Projection:
    """The camera that looks straight down on a plate that fills its square picture; the top row is +y."""
    pitch = size_mm / resolution
    return Projection(
        rows=resolution,
        cols=resolution,
        perspective=False,
        origin=np.array([-0.5 * size_mm, 0.5 * size_mm, 2.0 * size_mm]),
        across=np.array([pitch, 0.0, 0.0]),
        down=np.array([0.0, -pitch, 0.0]),
        along=np.array([0.0, 0.0, -1.0]),
        overhead=True,
    )


def projection_of(sensor: Any, rows: int, cols: int) -> Projection:
    """An orthographic or perspective sensor of Mitsuba, read off three of its rays.

    Args:
        rows, cols: of the picture, whose shape must be that of the sensor's film.
    """
    import mitsuba as mi

    u, v = (mi.Float(values) for values in ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]))
    ray, _ = sensor.sample_ray(0.0, 0.0, mi.Point2f(u, v), mi.Point2f(0.5, 0.5))
    origins, directions = (np.array(a, dtype=np.float64).T for a in (ray.o, ray.d))
    to_world = np.array(sensor.world_transform().matrix, dtype=np.float64).reshape(4, 4, -1)[:, :, 0]
    if np.allclose(directions, directions[0], atol=1e-6):
        corner, right, lower = origins
        return Projection(
            rows, cols, False, corner, (right - corner) / cols, (lower - corner) / rows, directions[0], False
        )
    # Rays of equal depth along the optical axis end in a plane, where the film is linear.
    axis = to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
    corner, right, lower = directions / (directions @ axis)[:, None]
    return Projection(
        rows,
        cols,
        True,
        to_world[:3, 3],
        (right - corner) / cols,
        (lower - corner) / rows,
        corner,
        False,
    )
