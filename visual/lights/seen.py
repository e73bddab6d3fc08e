"""Lights as rays see them: what mirrors and narrow highlights show."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.backend.mitsuba import dr, mi
from visual.backend.rays import vectors
from visual.lights.near import LightSet
from visual.lights.parallel import LOWEST, LUMINANCE

LEAST_DENSITY = 1e-3
"""Least number of fixed lights that counts for a steradian, against division by zero."""

OFF_POLE = 7e-4, 5e-4, 3e-4
"""Vector, some hundredths of a degree long, by which look-ups miss the pole of an environment map."""

SeenAlong = Callable[[Any, Any], tuple[Any, Any]]
"""Radiance of a light along rays from points in unit directions (of Dr.Jit), one channel or three, and the
distance of the light, mm; differentiable by both."""


@dataclass(frozen=True)
class SeenLight:
    """A light that rays can meet, and the fixed lights that represent it.

    Attributes:
        along: radiance along rays.
        surrounds: whether the light comes from all around, so that fixed lights end at `LOWEST`.
        lights_per_flux: of the fixed lights; 0 where mirrors alone count, which these do not reach.
    """

    along: SeenAlong
    surrounds: bool
    lights_per_flux: float = 0.0

    def distance(self, points: Array, toward: Array) -> Array:
        """Distances (points,), mm, of the light from points (points, 3) in unit directions (points, 3)."""
        if len(points) == 0:
            return np.zeros(0)
        _, distance = self.along(vectors(points), vectors(toward))
        return np.broadcast_to(np.asarray(distance, dtype=np.float64), len(points))

    def density(self, radiance: Any, toward: Any, cosine: Any) -> Any:
        """Fixed lights for each steradian where the light has this radiance along unit directions.

        None of them shine on a face from behind, where the `cosine` to the face's normal is negative.
        """
        density = dr.select(cosine > 0.0, self.lights_per_flux * luminance(radiance), 0.0)
        if self.surrounds:
            density = dr.select(toward.z < LOWEST, 0.0, density)
        return density + LEAST_DENSITY


def lights_per_flux(lights: LightSet) -> float:
    """Number of fixed lights for each unit of luminous irradiance at the origin, on planes that face them."""
    share = np.asarray(lights.arriving(dr.zeros(mi.Point3f, len(lights)), 1)[1], dtype=np.float64)
    flux = float((lights.strength @ LUMINANCE * share).sum())
    return len(lights) / flux if flux > 0.0 else 0.0


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

    def along(points: Any, toward: Any) -> tuple[Any, Any]:
        # At the pole of a map, which a level mirror shows of a sky overhead, there is no derivative.
        return environment_radiance(scene, dr.normalize(toward + mi.Vector3f(*OFF_POLE))), dr.inf

    return along
