"""Parallel lights, and ambient light as a set of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
"""Weights of red, green and blue, Mitsuba's (sRGB primaries)."""

LOWEST = -0.3
"""Sine of the lowest elevation that ambient light comes from. Past the plate's sides slopes that look outward
are lit from below its plane: without that light the gradient of a 1.5 mm relief under ambient light alone is
24 % off, from -0.15 up 7 %, from -0.3 up it is within the 5 % noise of finite differences."""


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


def ambient_lights(
    radiance: ArrayLike, count: int, generator: np.random.Generator | None = None
) -> ParallelLights:
    """Ambient light of constant radiance as parallel lights all over the sky, 2 pi (1 - LOWEST) L / K each.

    A golden-angle spiral, uniform in solid angle; with a generator the spiral is turned and shifted at
    random, which makes the quadrature unbiased when directions are drawn anew at every step.

    Args:
        radiance: L, one number or red, green and blue.
        count: K.
    """
    turn, shift = (
        (0.0, 0.5) if generator is None else (generator.uniform(0.0, 2.0 * np.pi), generator.uniform())
    )
    index = np.arange(count)
    z = LOWEST + (1.0 - LOWEST) * (index + shift) / count
    z = np.where(np.abs(z) < 1e-4, 1e-4, z)  # a light in the plane of the plate has no shadow to follow
    azimuth = turn + GOLDEN_ANGLE * index
    planar = np.sqrt(1.0 - z * z)
    toward = np.stack((planar * np.cos(azimuth), planar * np.sin(azimuth), z), axis=1)
    share = np.full(count, 2.0 * np.pi * (1.0 - LOWEST) / count)
    return ParallelLights(toward, np.multiply.outer(share, np.asarray(radiance, dtype=np.float64)))
