"""Near lights: points that shine from beside the plate, so that light turns and falls off across it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from relief.ground.arrays import Array, Index
from visual.backend.mitsuba import dr, mi
from visual.lights.parallel import ParallelLights, repeated

NEAREST = 0.25
"""Least distance of a near light from the flat plate, in sides of the plate: reliefs stay below the light."""

Lobe = Callable[[Any], Any]
"""Share of the intensity along a direction, by its cosine to the axis of the light; of Dr.Jit."""


def even(cosine: Any) -> Any:
    """The lobe of light that shines alike in all directions."""
    return dr.full(mi.Float, 1.0, dr.width(cosine))


def matte(cosine: Any) -> Any:
    """The lobe of a piece of a surface of constant radiance, which shines from the front alone."""
    return dr.maximum(cosine, 0.0)


@dataclass(frozen=True)
class NearLights:
    """A set of shining points.

    Attributes:
        position: (lights, 3) mm.
        intensity: (lights, 3) red, green and blue along the axis, irradiance times mm^2.
        axis: (lights, 3) unit vectors along which the points shine.
        lobe: of every point.
    """

    position: Array
    intensity: Array
    axis: Array
    lobe: Lobe = even

    def __len__(self) -> int:
        return len(self.intensity)

    def single(self, number: int) -> Self:
        """Light of this number alone."""
        one = [number]
        return type(self)(self.position[one], self.intensity[one], self.axis[one], self.lobe)

    @property
    def strength(self) -> Array:
        """(lights, 3) what `arriving` gives the share of."""
        return self.intensity

    def toward_from(self, number: int | Index, points: Array) -> Array:
        """Unit vectors (points, 3) from points (points, 3), mm, toward a light, or each toward its own."""
        offset = self.position[number] - points
        return np.asarray(offset / np.linalg.norm(offset, axis=1, keepdims=True))

    def distance(self, number: int | Index, points: Array) -> Array:
        """Distances (points,), mm, from points (points, 3) to a light, or each to its own."""
        return np.asarray(np.linalg.norm(self.position[number] - points, axis=1))

    def arriving(self, points: Any, each: int) -> tuple[Any, Any]:
        """Light at points, differentiable by them; see `ParallelLights.arriving`."""
        offset = repeated(self.position, each) - points
        square = dr.squared_norm(offset)
        toward = offset * dr.rsqrt(square)
        return toward, self.lobe(-dr.dot(toward, repeated(self.axis, each))) / square


LightSet = ParallelLights | NearLights
"""Lights that shine together."""


def flat_irradiance(lights: LightSet, points: Array) -> Array:
    """Irradiance (points, 3) of a flat plate at some of its points (points, 3), mm, red, green and blue."""
    where = mi.Vector3f(*(mi.Float(c) for c in np.tile(points, (len(lights), 1)).T.astype(np.float32)))
    toward, share = lights.arriving(where, len(points))
    upright = np.asarray(dr.maximum(toward.z, 0.0) * share, dtype=np.float64).reshape(len(lights), -1)
    return np.asarray(upright.T @ lights.strength)


def too_near(distance_mm: float, size_mm: float) -> str | None:
    """Why a light at this distance from the plate's square of this side (mm) has no gradients, or None."""
    if distance_mm >= NEAREST * size_mm:
        return None
    return f"gradients are only there for light at least {NEAREST * size_mm:g} mm from the plate"


def off_plate(points: Array, size_mm: float) -> float:
    """Least distance, mm, of points (points, 3) from the flat square of this side about the origin."""
    beyond = np.maximum(np.abs(points[:, :2]) - 0.5 * size_mm, 0.0)
    return float(np.sqrt((beyond**2).sum(1) + points[:, 2] ** 2).min())
