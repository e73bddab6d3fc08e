"""Area lights as points of the shining surface: parallel lights toward those far away, else near lights."""

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array
from visual.backend.mitsuba import dr, mi
from visual.lights.kind import Draw, EmitterShape, Light, LightKind
from visual.lights.near import NearLights, matte, off_plate, too_near
from visual.lights.parallel import GOLDEN_RATIO, ParallelLights, off_horizon
from visual.lights.seen import SeenAlong

SHAPES = ("disk", "rectangle", "sphere")
"""Shapes, by Mitsuba's names, whose area lights can be parallel lights."""
DISTANT = 40.0
"""Least distance of an area light that is parallel lights, in sides of the plate. At this distance, under a
disk of 2 degrees, the picture of a 1.5 mm relief is off by 1.5 % of its mean (light at 35 degrees) or 2 % (at
15), because parallel light does not fall off across the plate. The error is proportional to one over the
distance."""
LOOKED_AT = 256
"""Points of a shape by which its distance from the plate is found, within a sixteenth of its side."""
SOFT = 0.03
"""Width of the edge of a light that a mirror shows, half sides: the image of a sharp edge has no derivative
by the slopes of the mirror."""
ROUND = 1e-4
"""Tolerance of the scalar products of a sphere's axes, scaled to length 1."""


def area_lights(
    shape: EmitterShape, radiance: ArrayLike, count: int, generator: np.random.Generator | None = None
) -> ParallelLights:
    """A far light of constant radiance as parallel lights toward its points, as seen from the origin.

    Each parallel light represents an equal part of the area of a disk or a rectangle, which shine from the
    front alone, or of the solid angle of a sphere.

    Args:
        shape: its kind is one of `SHAPES`.
        radiance: L, one number or red, green and blue.
        count: K, lights.
        generator: draws other points at every call, without bias; None for fixed points.
    """
    part, around = _spread(count, generator)
    toward, solid_angle = (_sphere if shape.kind == "sphere" else _flat)(shape, part, around)
    strength = np.multiply.outer(solid_angle / count, np.asarray(radiance, dtype=np.float64))
    return ParallelLights(off_horizon(toward), strength)


def near_area_lights(
    shape: EmitterShape, radiance: ArrayLike, count: int, generator: np.random.Generator | None = None
) -> NearLights:
    """A light of constant radiance as near lights at its points, of equal areas; as `area_lights`."""
    point, normal, area = _points(shape, count, generator)
    intensity = np.asarray(radiance, dtype=np.float64) * (area / count)
    return NearLights(point, np.broadcast_to(intensity, (count, 3)), normal, matte)


def _spread(count: int, generator: np.random.Generator | None) -> tuple[Array, Array]:
    """Coordinates (count,) in [0, 1) of points that are evenly spread over a square."""
    first, second = (0.5, 0.5) if generator is None else generator.uniform(size=2)
    number = np.arange(count)
    return (number + first) / count, (second + GOLDEN_RATIO * number) % 1.0


def is_distant(shape: EmitterShape, size_mm: float) -> bool:
    """Whether a light on one of `SHAPES` is far enough from a plate of this side, mm, to be parallel."""
    return _nearest(shape) >= DISTANT * size_mm


def shape_obstacle(shape: EmitterShape) -> str | None:
    """Why light from a shape has no gradients at any distance; None if it has."""
    if shape.kind not in SHAPES:
        return f"{shape.kind}: gradients are only there for light from a disk, a rectangle or a sphere"
    axes = shape.to_world[:3, :3]
    if not abs(np.linalg.det(axes)) > 0.0:
        return f"{shape.kind}: to_world: has no inverse"
    scale = np.linalg.norm(axes[:, 0])
    if shape.kind == "sphere" and not np.allclose(axes.T @ axes / scale**2, np.eye(3), atol=ROUND):
        return "sphere: to_world: gradients are only there for the same scale along all axes"
    return None


def _nearest(shape: EmitterShape) -> float:
    """Distance from the origin to the nearest point of a shape of `SHAPES`, mm."""
    across, along, _, centre = shape.to_world[:3].T
    if shape.kind == "sphere":
        return float(np.linalg.norm(centre) - np.linalg.norm(across))
    place = np.array([-centre @ across / (across @ across), -centre @ along / (along @ along)])
    if shape.kind == "disk":
        place /= max(1.0, float(np.linalg.norm(place)))
    place = np.clip(place, -1.0, 1.0)
    return float(np.linalg.norm(centre + place[0] * across + place[1] * along))


def _points(
    shape: EmitterShape, count: int, generator: np.random.Generator | None = None
) -> tuple[Array, Array, float]:
    """Points of a shape, their normals, and its area; as `_on_flat`."""
    return (_on_sphere if shape.kind == "sphere" else _on_flat)(shape, *_spread(count, generator))


def _on_flat(shape: EmitterShape, part: Array, around: Array) -> tuple[Array, Array, float]:
    """Points of a disk or rectangle.

    Args:
        shape: a disk or rectangle.
        part, around: (lights,) in [0, 1), places of the points; equal steps of each cross equal areas.

    Returns:
        Points (lights, 3), mm, normals (lights, 3) of length 1, and the area of the shape, mm^2.
    """
    if shape.kind == "disk":
        radius, azimuth = np.sqrt(part), 2.0 * np.pi * around
        place, unit_area = np.stack((radius * np.cos(azimuth), radius * np.sin(azimuth))), np.pi
    else:
        place, unit_area = np.stack((2.0 * part - 1.0, 2.0 * around - 1.0)), 4.0
    across, along, _, centre = shape.to_world[:3].T
    normal = np.linalg.inv(shape.to_world[:3, :3])[2] * (-1.0 if shape.flipped else 1.0)
    area = unit_area * float(np.linalg.norm(np.cross(across, along)))
    points = centre + place.T @ np.stack((across, along))
    return points, np.broadcast_to(normal / np.linalg.norm(normal), points.shape), area


def _on_sphere(shape: EmitterShape, part: Array, around: Array) -> tuple[Array, Array, float]:
    """`_on_flat` for a sphere; from any place about half of the points are seen."""
    height, azimuth = 1.0 - 2.0 * part, 2.0 * np.pi * around
    level = np.sqrt(1.0 - height**2)
    outward = np.stack((level * np.cos(azimuth), level * np.sin(azimuth), height), axis=1)
    radius = float(np.linalg.norm(shape.to_world[:3, 0]))
    area = 4.0 * np.pi * radius**2
    return shape.to_world[:3, 3] + radius * outward, outward * (-1.0 if _inside_out(shape) else 1.0), area


def _inside_out(shape: EmitterShape) -> bool:
    """Whether a sphere shines inward alone."""
    return shape.flipped != bool(np.linalg.det(shape.to_world[:3, :3]) < 0.0)


def _flat(shape: EmitterShape, part: Array, around: Array) -> tuple[Array, Array]:
    """Directions (lights, 3) toward points of `_on_flat`, and the solid angle of the shape seen at each.

    The solid angles (lights,) are those of the whole shape if all of it were as near and as inclined as the
    point; 0 from behind.
    """
    point, normal, area = _on_flat(shape, part, around)
    distance = np.linalg.norm(point, axis=1)
    toward = point / distance[:, None]
    cosine = np.maximum(-np.einsum("li,li->l", toward, normal), 0.0)
    return toward, area * cosine / distance**2


def _sphere(shape: EmitterShape, part: Array, around: Array) -> tuple[Array, Array]:
    """`_flat` for a sphere: equal steps cross equal solid angles. A sphere turned inside out is dark."""
    centre = shape.to_world[:3, 3]
    axes = shape.to_world[:3, :3]
    distance = np.linalg.norm(centre)
    sine = np.linalg.norm(axes[:, 0]) / distance
    highest = sine**2 / (1.0 + np.sqrt(1.0 - sine**2))
    height, azimuth = highest * part, 2.0 * np.pi * around
    level = np.sqrt(height * (2.0 - height))
    middle = centre / distance
    side = np.cross(middle, np.eye(3)[np.argmin(np.abs(middle))])
    side /= np.linalg.norm(side)
    toward = np.outer(1.0 - height, middle) + level[:, None] * (
        np.outer(np.cos(azimuth), side) + np.outer(np.sin(azimuth), np.cross(middle, side))
    )
    return toward, np.full(len(part), 0.0 if _inside_out(shape) else 2.0 * np.pi * highest)


def _quadrature(light: Light, count: int, size_mm: float) -> Draw:
    assert light.shape is not None
    lights = near_area_lights if _is_near(light, size_mm) else area_lights
    return partial(lights, light.shape, np.array(light.strength), count)


def _is_near(light: Light, size_mm: float) -> bool:
    return light.shape is not None and not is_distant(light.shape, size_mm)


def _obstacle(light: Light, size_mm: float) -> str | None:
    if light.shape is None:
        return "is not on a shape"
    obstacle = shape_obstacle(light.shape)
    if obstacle is None:
        reason = too_near(off_plate(_points(light.shape, LOOKED_AT)[0], size_mm), size_mm)
        obstacle = None if reason is None else f"{light.shape.kind}: {reason}"
    return obstacle


def _along(light: Light, scene: Any) -> SeenAlong:
    """An area light as rays see it, with an edge that is `SOFT` wide."""
    shape = light.shape
    assert shape is not None and light.strength is not None
    inverse = np.linalg.inv(shape.to_world)
    axes, shift = inverse[:3, :3].T.tolist(), inverse[:3, 3].tolist()
    ball, inward = shape.kind == "sphere", _inside_out(shape)
    front = 1.0 if shape.flipped else -1.0
    colour = mi.Color3f(*light.strength)
    strength = mi.Color1f(mi.luminance(colour)) if mi.is_monochromatic else colour

    def along(points: Any, toward: Any) -> tuple[Any, Any]:
        start, step = (
            sum((mi.Vector3f(axis) * v[number] for number, axis in enumerate(axes)), first)
            for v, first in ((points, mi.Vector3f(shift)), (toward, mi.Vector3f(0.0)))
        )
        # Of a sphere, the place nearest to the centre; of a plane, where the ray crosses it.
        distance = -dr.dot(start, step) / dr.squared_norm(step) if ball else -start.z / step.z
        place = start + distance * step
        if shape.kind == "rectangle":
            off = dr.maximum(dr.abs(place.x), dr.abs(place.y))
        else:
            off = dr.norm(place if ball else mi.Vector2f(place.x, place.y))
        inside = dr.clip(0.5 + (1.0 - off) / SOFT, 0.0, 1.0)
        # A sphere that shines inward is seen from inside alone.
        faces = (dr.squared_norm(start) < 1.0) == inward if ball else front * step.z > 0.0
        if ball:
            half = dr.safe_sqrt(1.0 - off**2) / dr.norm(step)
            distance += half if inward else -half
        return strength * dr.select(faces & (distance > 0.0), inside, 0.0), distance

    return along


AREA = LightKind(
    lambda light: "shining surface",
    "radiance",
    _quadrature,
    _obstacle,
    _is_near,
    on_shape=True,
    met_by_chance=True,
    seen=_along,
)
