"""Normal curvatures of an object along the axes of its texture."""

from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array, Flags, quantiles
from relief.solids.body import Body
from relief.solids.wrapping.coordinates.layout import Layout

STRAIGHT_MM = 200.0
"""Least radius of a surface that counts as straight, mm: over a patch of 10 mm such a surface rises by 0.06
mm."""
LEAST_MM = 3.0
"""Least radius that is reported, mm: the least that models of touch take."""
HALF = (0.25, 0.75)
"""Lower and upper quartile, as shares of the area."""
DEGENERATE = 1e-9
"""Area in the texture, mm², below which a triangle has no directions there."""


class Bending(NamedTuple):
    """Curvatures of the textured surface along an axis of the texture, 1/mm; positive where it bulges.

    Attributes:
        median: over the textured area.
        low: lower quartile.
        high: upper quartile.
    """

    median: float
    low: float
    high: float

    @property
    def radius_mm(self) -> float | None:
        """Radius of the median, mm, negative in a hollow; None where the surface is straight."""
        if abs(self.median) <= 1.0 / STRAIGHT_MM:
            return None
        return float(np.copysign(max(LEAST_MM, abs(1.0 / self.median)), self.median))


def bending(body: Body, normals: Array, layout: Layout, where: Flags) -> tuple[Bending, Bending]:
    """Curvatures along x, to the texture's right, and along y, to its top.

    Args:
        body: the surface.
        normals: (faces, 3, 3) unit normals at the corners.
        layout: coordinates of the texture; those of a triangle's leading patch count.
        where: (faces,) triangles that carry texture.
    """
    faces = np.flatnonzero(where & layout.laid())
    uv = layout.uv[faces, layout.leading()[faces]]
    corners, normals = body.vertices[body.faces[faces]], normals[faces]
    edges = (uv[:, 1:] - uv[:, :1]).transpose(0, 2, 1)
    determinant = np.linalg.det(edges)
    sound = np.abs(determinant) > DEGENERATE
    inverse = np.linalg.inv(edges[sound])
    # Derivatives of the place and of the normal by the coordinates, (faces, 3, 2).
    place, turn = (
        (values[sound, 1:] - values[sound, :1]).transpose(0, 2, 1) @ inverse for values in (corners, normals)
    )
    curvature = (place * turn).sum(axis=1) / np.maximum((place**2).sum(axis=1), DEGENERATE)
    areas = body.areas[faces][sound]
    one, other = (_over_area(curvature[:, axis], areas) for axis in range(2))
    return one, other


def _over_area(values: Array, areas: Array) -> Bending:
    """Median and quartiles of values (n,), weighted by areas (n,)."""
    if not len(values):
        return Bending(0.0, 0.0, 0.0)
    return Bending(*quantiles(values, areas, [0.5, *HALF]).tolist())
