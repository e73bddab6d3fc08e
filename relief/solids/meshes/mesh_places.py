"""Contact locations on a mesh: spread evenly over the surface, with the axes along which a finger presses."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, sums_by, units
from relief.places import SPACING_MM
from relief.solids.body import Body

POINTS_PER_MM2, FEWEST_POINTS, MOST_POINTS = 4.0, 4000, 200_000
"""Density of the sample points of a surface, 1/mm², and their least and greatest number."""
REACH_MM = 7.5
"""Radius of the surroundings that the axis of a place is fitted to, mm: those of the corners of a patch."""
FACING = 0.2
"""Least cosine between axis and normal of the points that an axis is fitted to; the others are walls."""
BED_MM, DOWN = 0.02, -0.999
"""Height above the lowest vertex, mm, and z of the normal, below which a face lies on the printer's bed."""


@dataclass(frozen=True)
class Frame:
    """A contact location with its axes.

    Attributes:
        at: (3,) mm.
        axes: (3, 3) rows x, y and the outward axis of the finger; x lies towards +x of the file, or +y where
            the axis is near x.
    """

    at: Array
    axes: Array

    def local(self, points: Array) -> Array:
        """Points (..., 3) of the file in the axes of the place."""
        return np.asarray((points - self.at) @ self.axes.T)


@dataclass(frozen=True)
class SurfacePoints:
    """Points evenly on a surface.

    Attributes:
        at: (k, 3) mm.
        normals: (k, 3) of their faces.
        area_mm2: of the surface.
    """

    at: Array
    normals: Array
    area_mm2: float


def vertex_normals(body: Body) -> Array:
    """(n, 3) unit normals of vertices, the mean over their faces by area."""
    return units(sums_by(body.faces, np.repeat(body.normals, 3, axis=0), len(body.vertices)))


def surface_points(body: Body, with_bed: bool = False) -> SurfacePoints:
    """Points on a body, as many on equal areas.

    Args:
        body: a solid.
        with_bed: also on the side that lies on the printer's bed. A body that is nothing but that side, which
            no solid is, keeps it anyway.
    """
    normals = body.normals
    double = np.linalg.norm(normals, axis=1)
    unit = units(normals)
    highest = body.vertices[body.faces, 2].max(axis=1)
    bed = (unit[:, 2] < DOWN) & (highest < body.vertices[:, 2].min() + BED_MM)
    weights = double if with_bed or bed.all() else np.where(bed, 0.0, double)
    area = 0.5 * float(weights.sum())
    count = int(np.clip(area * POINTS_PER_MM2, FEWEST_POINTS, MOST_POINTS))
    random = np.random.default_rng(0)
    # One point in each of `count` equal shares of the area, in the order of the faces.
    shares = (np.arange(count) + random.random(count)) / count
    face = np.searchsorted(np.cumsum(weights) / weights.sum(), shares, side="right").clip(
        max=len(weights) - 1
    )
    u, v = random.random((2, count))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    a, b, c = np.moveaxis(body.vertices[body.faces[face]], 1, 0)
    return SurfacePoints(a + u[:, None] * (b - a) + v[:, None] * (c - a), unit[face], area)


def spread(points: Array, most: int, spacing_mm: float = SPACING_MM) -> Index:
    """Numbers of points, each the farthest from those before it.

    Args:
        points: (k, 3) mm.
        most: most numbers.
        spacing_mm: distance at which no more are taken, mm.

    Returns:
        (n,) numbers; the first is that of the highest point.
    """
    numbers = [int(points[:, 2].argmax())]
    distance = np.linalg.norm(points - points[numbers[0]], axis=1)
    while len(numbers) < most and distance.max() >= spacing_mm:
        numbers.append(int(distance.argmax()))
        np.minimum(distance, np.linalg.norm(points - points[numbers[-1]], axis=1), out=distance)
    return np.array(numbers)


def frames(points: SurfacePoints, numbers: Index) -> list[Frame]:
    """Frames of some of the points, each with the axis of a plane through its surroundings."""
    tree = cKDTree(points.at)
    return [
        _fitted(points, number, np.array(near, dtype=np.int64))
        for number, near in zip(numbers, tree.query_ball_point(points.at[numbers], REACH_MM), strict=True)
    ]


def _fitted(points: SurfacePoints, number: int, near: Index) -> Frame:
    """The frame of a point.

    The initial axis is the mean normal of points nearby; it is refined to the normal of a plane fitted by
    least squares. A second-order surface is fitted with it, so that curvature does not tilt a plane beside an
    edge.
    """
    at = points.at[number]
    offset, normals = points.at[near] - at, points.normals[near]
    distance = np.linalg.norm(offset, axis=1)
    axis = points.normals[number]
    for reach in (1.0, 2.5):
        weights = np.clip(1.0 - distance / reach, 0.0, None) * np.clip(normals @ axis, 0.0, None)
        axis = _unit((weights[:, None] * normals).sum(axis=0), axis)
    for _ in range(3):
        axes = _axes(axis)
        x, y, z = axes @ offset.T
        facing = normals @ axis
        # Each point stands for the area that is seen along the axis.
        weights = np.sqrt(np.clip(1.0 - (x**2 + y**2) / REACH_MM**2, 0.0, None) ** 2 * facing.clip(min=0.0))
        used = (facing > FACING) & (np.abs(z) < 0.5 * REACH_MM) & (weights > 0.0)
        if np.count_nonzero(used) < 20:
            break
        terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)[used]
        surface, *_ = np.linalg.lstsq(terms * weights[used, None], z[used] * weights[used], rcond=1e-6)
        axis = _unit(axis - surface[1] * axes[0] - surface[2] * axes[1], axis)
    return Frame(at, _axes(axis))


def frame_along(at: Array, axis: Array) -> Frame:
    """The frame of a point with a given axis, a unit vector."""
    return Frame(at, _axes(axis))


def _unit(vector: Array, otherwise: Array) -> Array:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 1e-12 else otherwise


def _axes(axis: Array) -> Array:
    towards = np.array([1.0, 0.0, 0.0]) if abs(axis[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = _unit(towards - (towards @ axis) * axis, towards)
    return np.stack([x, np.cross(axis, x), axis])
