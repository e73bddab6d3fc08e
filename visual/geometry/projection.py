"""Projections of cameras: rays through film points, points of the film under points of space, and Jacobians.

Film coordinates are pixels (column, row), from the upper left corner of the picture to the right and down.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from relief.ground.arrays import Array, Index
from visual.backend.mitsuba import mi
from visual.geometry.film_filter import FilmFilter


@dataclass(frozen=True)
class Projection:
    """An orthographic or perspective camera.

    Attributes:
        rows, cols: of the picture.
        perspective: whether all rays start from one point.
        origin: (3,) mm, start of these rays, or the upper left corner of the film if the rays are parallel.
        across, down: (3,) step of one pixel to the right and down, mm if the rays are parallel, else a change
            of direction.
        along: (3,) unit direction of parallel rays, else direction of the ray through the upper left corner.
        overhead: whether the camera looks straight down on a plate that fills the picture.
        filter: reconstruction filter of the film; None for a box.
    """

    rows: int
    cols: int
    perspective: bool
    origin: Array
    across: Array
    down: Array
    along: Array
    overhead: bool
    filter: FilmFilter | None = None

    @property
    def pixels(self) -> int:
        """Number of pixels of the picture."""
        return self.rows * self.cols

    def finer(self, parts: int) -> "Projection":
        """This camera with `parts` pixels along each side of a pixel, and a box filter."""
        across, down = self.across / parts, self.down / parts
        return replace(
            self, rows=self.rows * parts, cols=self.cols * parts, across=across, down=down, filter=None
        )

    @cached_property
    def _inverse(self) -> Array:
        return np.linalg.inv(np.stack((self.across, self.down, self.along), axis=1))

    def rays(self, film: Array) -> tuple[Array, Array]:
        """Origins, mm, and unit directions, each (points, 3), of the rays through film points (points, 2)."""
        spread = film[:, :1] * self.across + film[:, 1:] * self.down
        if self.perspective:
            directions = spread + self.along
            directions /= np.linalg.norm(directions, axis=1, keepdims=True)
            return np.broadcast_to(self.origin, directions.shape), directions
        return self.origin + spread, np.broadcast_to(self.along, spread.shape)

    def project(self, points: Array) -> Array:
        """Film coordinates (points, 2) of points (points, 3), mm."""
        local = (points - self.origin) @ self._inverse.T
        return local[:, :2] / local[:, 2:] if self.perspective else local[:, :2]

    def jacobian(self, points: Array) -> Array:
        """Derivatives (points, 2, 3) of film coordinates, pixels per mm, at points (points, 3), mm."""
        inverse = self._inverse
        if not self.perspective:
            return np.broadcast_to(inverse[:2], (len(points), 2, 3))
        local = (points - self.origin) @ inverse.T
        film = local[:, :2] / local[:, 2:]
        return np.asarray((inverse[:2] - film[:, :, None] * inverse[2]) / local[:, 2, None, None])

    def toward(self, points: Array) -> Array:
        """Unit vectors (points, 3) from points (points, 3), mm, toward the camera."""
        if not self.perspective:
            return np.broadcast_to(-self.along, points.shape)
        offset = self.origin - points
        return np.asarray(offset / np.linalg.norm(offset, axis=1, keepdims=True))

    def pixel(self, film: Array) -> Index:
        """Numbers (points,), row by row, of the pixels of film points (points, 2); -1 beyond the picture."""
        col, row = np.floor(film).astype(np.int64).T
        inside = (col >= 0) & (col < self.cols) & (row >= 0) & (row < self.rows)
        return np.where(inside, row * self.cols + col, -1)


def from_above(size_mm: float, rows: int, cols: int) -> Projection:
    """The camera that looks straight down on a plate that fills the picture; the top row is +y.

    Args:
        size_mm: width of the plate.
        rows, cols: of the picture, whose pixels are square.
    """
    pitch = size_mm / cols
    return Projection(
        rows=rows,
        cols=cols,
        perspective=False,
        origin=np.array([-0.5 * size_mm, 0.5 * size_mm * (rows / cols), 2.0 * size_mm]),
        across=np.array([pitch, 0.0, 0.0]),
        down=np.array([0.0, -pitch, 0.0]),
        along=np.array([0.0, 0.0, -1.0]),
        overhead=True,
    )


def projection_of(sensor: Any, rows: int, cols: int) -> Projection:
    """The projection of an orthographic or perspective sensor of Mitsuba, from three of its rays.

    Args:
        sensor: of a Mitsuba scene.
        rows, cols: of the picture, in the proportions of the sensor's film.
    """
    u, v = (mi.Float(values) for values in ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]))
    ray, _ = sensor.sample_ray(0.0, 0.0, mi.Point2f(u, v), mi.Point2f(0.5, 0.5))
    origins, directions = (np.array(a, dtype=np.float64).T for a in (ray.o, ray.d))
    to_world = np.array(sensor.world_transform().matrix, dtype=np.float64).reshape(4, 4, -1)[:, :, 0]
    perspective = not np.allclose(directions, directions[0], atol=1e-6)
    corner, right, lower = origins
    origin, along = corner, directions[0]
    if perspective:
        # Rays of equal depth along the optical axis end in a plane, where the film is linear.
        axis = to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
        corner, right, lower = directions / (directions @ axis)[:, None]
        origin, along = to_world[:3, 3], corner
    across, down = (right - corner) / cols, (lower - corner) / rows
    return Projection(rows, cols, perspective, origin, across, down, along, overhead=False)
