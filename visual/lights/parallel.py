"""Parallel lights: directions, each with an irradiance. Every other kind of light becomes such a set."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array, Index
from visual.backend.mitsuba import mi

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
GOLDEN_RATIO = 0.5 * (np.sqrt(5.0) - 1.0)

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
"""Luminance of red, green and blue: Mitsuba's weights for sRGB primaries."""

LOWEST = -0.3
"""Sine of the lowest elevation of ambient light. At the rim of the plate slopes that look outward are lit
from below its plane: without this light the gradient of a 1.5 mm relief under ambient light alone is 24 %
off, from -0.15 up 7 %, from -0.3 up less than the 5 % noise of finite differences."""

HORIZON = 1e-4
"""Least sine of the elevation, up or down, of a parallel light that represents another light."""
OVERHEAD = 1e-6
"""Largest horizontal part of the direction toward a light that stands straight above: a face would have to
rise a million times as far as it is wide to turn away from such a light."""


@dataclass(frozen=True)
class ParallelLights:
    """A set of parallel lights.

    Attributes:
        toward: (lights, 3) unit vectors toward the lights.
        irradiance: (lights,) on a plane that faces the light; or (lights, 3) red, green and blue.
    """

    toward: Array
    irradiance: Array

    def __len__(self) -> int:
        return len(self.irradiance)

    def single(self, number: int) -> Self:
        """Light of this number alone."""
        return type(self)(self.toward[[number]], self.irradiance[[number]])

    @property
    def strength(self) -> Array:
        """(lights, 3) irradiance, whose shares `arriving` gives."""
        return np.broadcast_to(self.irradiance.reshape(len(self), -1), (len(self), 3))

    def toward_from(self, number: int | Index, points: Array) -> Array:
        """Unit vectors toward a light (3,), or toward its own from each of some points (points, 3)."""
        return self.toward[number]

    def distance(self, number: int | Index, points: Array) -> Array:
        """Distances from points (points, 3), mm, to a light: infinite, (points,)."""
        return np.full(len(points), np.inf)

    def arriving(self, points: Any, each: int) -> tuple[Any, Any]:
        """Light at points.

        Args:
            points: `mi.Vector3f`, as many for each light, light by light.
            each: number of points for each light.

        Returns:
            Unit vectors toward the lights, and irradiance on a plane that faces the light over `strength`.
        """
        return repeated(self.toward, each), mi.Float(1.0)


def joined(sets: Sequence[ParallelLights]) -> ParallelLights:
    """The lights of all sets, one after the other; red, green and blue."""
    none = np.zeros((0, 3))
    toward, strength = (
        np.concatenate([none, *(getattr(lights, name) for lights in sets)]) for name in ("toward", "strength")
    )
    return ParallelLights(toward, strength)


def repeated(vectors: Array, times: int) -> Any:
    """Vectors (lights, 3) as `mi.Vector3f`, each so many times."""
    columns = np.repeat(vectors, times, axis=0).T.astype(np.float32)
    return mi.Vector3f(*(mi.Float(np.ascontiguousarray(column)) for column in columns))


def off_horizon(toward: Array) -> Array:
    """Unit vectors (lights, 3), where those in the plane of the plate are tilted a little above the plane.

    A light in the plane has no shadow whose motion could be followed.
    """
    level = np.abs(toward[:, 2]) < HORIZON
    tilted = toward + np.outer(level * (HORIZON - toward[:, 2]), (0.0, 0.0, 1.0))
    return tilted / np.linalg.norm(tilted, axis=1, keepdims=True)


def angles(toward: ArrayLike) -> tuple[float, float]:
    """Azimuth in [0, 360) and elevation of a unit vector, degrees, both to a tenth."""
    x, y, z = np.asarray(toward, dtype=np.float64)
    azimuth = round(float(np.degrees(np.arctan2(y, x))) % 360.0, 1) % 360.0
    # Adding 0 turns a negative zero into a positive one.
    return azimuth, round(float(np.degrees(np.arcsin(np.clip(z, -1.0, 1.0)))), 1) + 0.0
