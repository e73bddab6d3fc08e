"""Quadrature of light: the table of all kinds of light, and lights of any kind as parallel ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from relief.common.errors import InputError
from visual.lights.ambient import AMBIENT
from visual.lights.area import AREA
from visual.lights.directional import DIRECTIONAL
from visual.lights.environment import ENVIRONMENT
from visual.lights.kind import Draw, Light, LightKind
from visual.lights.parallel import ParallelLights
from visual.lights.point import POINT

KINDS: dict[str, LightKind] = {
    "directional": DIRECTIONAL,
    "constant": AMBIENT,
    "envmap": ENVIRONMENT,
    "area": AREA,
    "point": POINT,
}
"""Kinds of light that a scene may hold, by Mitsuba's names of its emitters."""


def kind_of(light: Light) -> LightKind:
    """What is particular to the kind of a light."""
    return KINDS[light.kind]


@dataclass(frozen=True)
class Quadrature:
    """Lights whose pictures are read and gathered, so that parallel lights can be drawn many times.

    Attributes:
        sources: what draws the parallel lights of each light.
    """

    sources: tuple[Draw, ...]

    def lights(self, generator: np.random.Generator | None = None) -> ParallelLights:
        """All parallel lights, shining together, source by source; red, green and blue."""
        drawn = [source(generator) for source in self.sources]
        toward = [np.zeros((0, 3)), *(lights.toward for lights in drawn)]
        colours = (np.broadcast_to(k.irradiance.reshape(len(k), -1), (len(k), 3)) for k in drawn)
        return ParallelLights(np.concatenate(toward), np.concatenate([np.zeros((0, 3)), *colours]))


def prepare(lights: Sequence[Light], size_mm: float, count: int) -> Quadrature:
    """Read all that the parallel lights of some lights are drawn from.

    Args:
        lights: of a checked scene, in whose variant Mitsuba is.
        size_mm: side of the plate.
        count: K, parallel lights for each light that is not directional.

    Raises:
        InputError: a light that has a `parallel_obstacle`, or a bad picture of an environment map.
    """
    for light in lights:
        obstacle = parallel_obstacle(light, size_mm)
        if obstacle is not None:
            raise InputError(obstacle)
    kinds = [(light, kind_of(light).quadrature) for light in lights]
    return Quadrature(tuple(quadrature(light, count) for light, quadrature in kinds if quadrature))


def parallel_obstacle(light: Light, size_mm: float) -> str | None:
    """Why a light over a plate of this side (mm) cannot be parallel lights; None if it can. Reads no file.

    Returns:
        Element, field and reason, in one line.
    """
    kind = kind_of(light)
    if kind.quadrature is None:
        *others, last = (name for name, other in KINDS.items() if other.quadrature is not None)
        return f"{light.kind}: gradients are only there for {', '.join(others)} and {last} light"
    obstacle = kind.obstacle(light, size_mm)
    if obstacle is None and kind.strength is not None and light.strength is None:
        obstacle = f"{kind.strength}: gradients are only there for a number or an rgb colour"
    return None if obstacle is None else f"{light.kind}: {obstacle}"
