"""Quadrature of light: the table of all kinds of light, and lights of any kind as parallel or near ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relief.ground.errors import InputError
from visual.lights.ambient import AMBIENT
from visual.lights.area_lights import AREA
from visual.lights.directional import DIRECTIONAL
from visual.lights.environment import ENVIRONMENT
from visual.lights.kind import Draw, Light, LightKind
from visual.lights.near import LightSet, NearLights
from visual.lights.parallel import ParallelLights, joined
from visual.lights.point import POINT, SPOT

KINDS: dict[str, LightKind] = {
    "directional": DIRECTIONAL,
    "constant": AMBIENT,
    "envmap": ENVIRONMENT,
    "area": AREA,
    "point": POINT,
    "spot": SPOT,
}
"""Kinds of light that a scene may hold, by Mitsuba's names of its emitters."""


def kind_of(light: Light) -> LightKind:
    """Properties of the kind of a light."""
    return KINDS[light.kind]


@dataclass(frozen=True)
class Quadrature:
    """Lights whose pictures are read and gathered, so that lights can be drawn many times.

    Attributes:
        sources: what draws the lights of each light; a near one is alone.
    """

    sources: tuple[Draw, ...]

    def lights(self, generator: np.random.Generator | None = None) -> LightSet:
        """All lights, shining together, source by source; red, green and blue."""
        every = [source(generator) for source in self.sources]
        for near in every:
            if isinstance(near, NearLights):
                return near
        drawn = [lights for lights in every if isinstance(lights, ParallelLights)]
        return joined(drawn)


def prepare(lights: Sequence[Light], size_mm: float, count: int) -> Quadrature:
    """Read everything that is needed to draw the parallel or near lights that represent some lights.

    Args:
        lights: of a checked scene, in whose variant Mitsuba is; one near light, or any others.
        size_mm: side of the plate.
        count: K, lights for each light that is neither directional nor a point.

    Raises:
        InputError: a light that has an obstacle, or a bad picture of an environment map.
    """
    for light in lights:
        reason = light_obstacle(light, size_mm)
        if reason is not None:
            raise InputError(reason)
    return Quadrature(tuple(kind_of(light).quadrature(light, count, size_mm) for light in lights))


def light_obstacle(light: Light, size_mm: float) -> str | None:
    """Why pictures of a plate of this side (mm) have no gradients under a light; None if they have.

    Reads no file.

    Returns:
        Element, field and reason, in one line.
    """
    kind = kind_of(light)
    obstacle = kind.obstacle(light, size_mm)
    if obstacle is None and kind.strength is not None and light.strength is None:
        obstacle = f"{kind.strength}: gradients are only there for a number or an rgb colour"
    return None if obstacle is None else f"{light.kind}: {obstacle}"


def parallel_obstacle(light: Light, size_mm: float) -> str | None:
    """Why a light over a plate of this side (mm) cannot be parallel lights; as `light_obstacle`."""
    obstacle = light_obstacle(light, size_mm)
    if obstacle is None and kind_of(light).near(light, size_mm):
        return f"{light.kind}: shines from near the plate, not as parallel light"
    return obstacle
