"""Parallel lights, and ambient light as a set of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True)
class ParallelLights:
    """A set of parallel lights.

    Attributes:
        toward: (lights, 3) unit vectors toward the lights.
        irradiance: (lights,) on a plane that faces the light.
    """

    toward: Array
    irradiance: Array

    def __len__(self) -> int:
        return len(self.irradiance)


def ambient_lights(
    radiance: float, count: int, generator: np.random.Generator | None = None
) -> ParallelLights:
    """Ambient light of constant radiance as parallel lights spread over the upper hemisphere, 2 pi L / K
    each.

    A golden-angle spiral, uniform in solid angle; with a generator the spiral is turned and shifted at
    random, which makes the quadrature unbiased when directions are drawn anew at every step.

    Args:
        radiance: L.
        count: K.
    """
    turn, shift = (
        (0.0, 0.5) if generator is None else (generator.uniform(0.0, 2.0 * np.pi), generator.uniform())
    )
    index = np.arange(count)
    z = (index + shift) / count
    z = np.maximum(z, 1e-4)  # a light in the plane of the plate has no shadow to follow
    azimuth = turn + GOLDEN_ANGLE * index
    planar = np.sqrt(1.0 - z * z)
    toward = np.stack((planar * np.cos(azimuth), planar * np.sin(azimuth), z), axis=1)
    return ParallelLights(toward, np.full(count, 2.0 * np.pi * radiance / count))
