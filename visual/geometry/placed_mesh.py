"""A relief standing in a Mitsuba scene: its faces as rays toward a light meet them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visual.backend.rays import blocked
from visual.geometry.topology import PlateTopology

Array = NDArray[np.float64]
Index = NDArray[np.int64]

LIFT_MM = 3e-5
"""Rays start this far above the surface. More lets light slip past shallow silhouettes: at 5e-4 the gradient
of a smooth relief under a light at 20 degrees is 13 % off, at 1e-4 2.4 %; from 3e-5 down to 3e-6 it is
within the 1 % noise of finite differences; at 0 edges shadow themselves."""


@dataclass(frozen=True)
class PlacedMesh:
    """A relief in a scene.

    Attributes:
        scene: a Mitsuba scene that holds the plate at `heights`.
        heights: (rows, cols) mm.
    """

    scene: Any
    plate: PlateTopology
    heights: Array

    @cached_property
    def slopes(self) -> tuple[Array, Array]:
        """dz/dx and dz/dy of every face, each (faces,)."""
        return self.plate.slopes(self.heights)

    @cached_property
    def vertices(self) -> Array:
        """(vertices, 3) mm."""
        plate = self.plate
        return np.stack((plate.x, plate.y, plate.vertex_heights(self.heights)), axis=1)

    @cached_property
    def centres(self) -> Array:
        """(faces, 3) mm."""
        return np.asarray(self.vertices[self.plate.faces].mean(1))

    def facing(self, toward: Array) -> NDArray[np.bool_]:
        """(faces,): whether they look toward a direction (3,), or each toward its own (faces, 3)."""
        x, y, z = np.asarray(toward).T
        return np.asarray(z - self.slopes[0] * x - self.slopes[1] * y > 0.0)

    def lifted(self, face: Index, x: Array, y: Array) -> Array:
        """Points (points, 3) mm from which shadow rays start: just above faces, over x and y."""
        first = self.plate.faces[face, 0]
        origin = self.vertices[first]
        z = (
            origin[:, 2]
            + self.slopes[0][face] * (x - origin[:, 0])
            + self.slopes[1][face] * (y - origin[:, 1])
        )
        return np.stack((x, y, z + LIFT_MM), axis=1)

    def sees(self, toward: Array, face: Index, points: Array) -> NDArray[np.bool_]:
        """Whether lifted points (points, 3) of faces see a parallel light; no ray for those turned away."""
        lit = self.facing(toward)[face]
        facing = np.flatnonzero(lit)
        lit[facing] = ~blocked(self.scene, points[facing], np.broadcast_to(toward, (len(facing), 3)))
        return lit
