"""Ambient light: constant radiance from all around, as parallel lights all over the sky."""

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from visual.lights.kind import UNSAMPLED, LightKind
from visual.lights.parallel import GOLDEN_ANGLE, LOWEST, ParallelLights, off_horizon
from visual.lights.seen import along_environment


def ambient_lights(
    radiance: ArrayLike, count: int, generator: np.random.Generator | None = None
) -> ParallelLights:
    """Ambient light of constant radiance as parallel lights, 2 pi (1 - LOWEST) L / K each.

    The directions lie on a golden-angle spiral, uniform in solid angle. With a generator the spiral is turned
    and shifted at random, so that the quadrature has no bias if directions are drawn anew at every step.

    Args:
        radiance: L, one number or red, green and blue.
        count: K.
        generator: None for fixed directions.
    """
    turn, shift = (
        (0.0, 0.5) if generator is None else (generator.uniform(0.0, 2.0 * np.pi), generator.uniform())
    )
    index = np.arange(count)
    z = LOWEST + (1.0 - LOWEST) * (index + shift) / count
    azimuth = turn + GOLDEN_ANGLE * index
    planar = np.sqrt(1.0 - z * z)
    toward = np.stack((planar * np.cos(azimuth), planar * np.sin(azimuth), z), axis=1)
    share = np.full(count, 2.0 * np.pi * (1.0 - LOWEST) / count)
    return ParallelLights(
        off_horizon(toward), np.multiply.outer(share, np.asarray(radiance, dtype=np.float64))
    )


AMBIENT = LightKind(
    lambda light: "light from all around",
    "radiance",
    lambda light, count, size_mm: partial(ambient_lights, np.array(light.strength), count),
    ambient=True,
    surrounds=True,
    met_by_chance=True,
    seen=lambda light, scene: along_environment(scene),
    switch=(*UNSAMPLED, "radiance.value"),
)
