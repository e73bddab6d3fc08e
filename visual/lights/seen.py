"""Lights as rays see them: what mirrors and narrow highlights show."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.backend.mitsuba import dr, mi
from visual.lights.near import LightSet
from visual.lights.parallel import LOWEST, LUMINANCE

LEAST_DENSITY = 1e-3
"""Least number of fixed lights that counts for a steradian, against division by zero."""

SeenAlong = Callable[[Any, Any], tuple[Any, Any]]
"""Radiance of a light along rays from points (Dr.Jit) in unit directions, one channel or three, and the distance
of the light, mm; differentiable by both."""


@dataclass(frozen=True)
class SeenLight:
    """A light that rays can meet, and the fixed lights that represent it.

    Attributes:
        along: radiance along rays.
        lights_per_flux: fixed lights for each unit of their luminous irradiance on a plane that faces them.
        surrounds: whether the light comes from all around, so that fixed lights end at `LOWEST`.
    """

    along: SeenAlong
    lights_per_flux: float
    surrounds: bool

    def distance(self, points: Array, toward: Array) -> Array:
        """Distances (points,), mm, of the light from points (points, 3) in unit directions (points, 3)."""
        if len(points) == 0:
            return np.zeros(0)
        rays = (
            mi.Vector3f(*(mi.Float(np.ascontiguousarray(axis, dtype=np.float32)) for axis in vectors.T))
            for vectors in (points, toward)
        )
        return np.broadcast_to(np.asarray(self.along(*rays)[1], dtype=np.float64), len(points))

    def density(self, radiance: Any, toward: Any) -> Any:
        """Fixed lights for each steradian where the light has this radiance along unit directions."""
        density = self.lights_per_flux * luminance(radiance)
        if self.surrounds:
            density = dr.select(toward.z < LOWEST, 0.0, density)
        return density + LEAST_DENSITY


def seen_light(along: SeenAlong, lights: LightSet, surrounds: bool) -> SeenLight | None:
    """A light that these fixed lights represent; None for a black one."""
    strength = np.broadcast_to(np.reshape(lights.strength, (len(lights), -1)), (len(lights), 3)) @ LUMINANCE
    share = np.asarray(lights.arriving(dr.zeros(mi.Point3f, len(lights)), 1)[1], dtype=np.float64)
    flux = float((strength * share).sum())
    return SeenLight(along, len(lights) / flux, surrounds) if flux > 0.0 else None


def luminance(colour: Any) -> Any:
    """Luminance of a colour in the variant that is set."""
    return colour[0] if mi.is_monochromatic else mi.luminance(mi.Color3f(colour))


def environment_radiance(scene: Any, toward: Any) -> Any:
    """Radiance, of Dr.Jit, of the constant light or environment map of a Mitsuba scene in unit directions."""
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(toward))
    si.wi = -toward
    return scene.environment().eval(si)


def along_environment(scene: Any) -> SeenAlong:
    """A constant light or environment map as rays see it."""
    return lambda points, toward: (environment_radiance(scene, toward), dr.inf)
