"""Parallel lights, and other lights as sets of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from relief.errors import InputError
from visual.scene_file.describe import AMBIENT, AREA, ENVIRONMENT, PARALLEL, Light

Array = NDArray[np.float64]

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
GOLDEN_RATIO = 0.5 * (np.sqrt(5.0) - 1.0)

LUMINANCE = np.array([0.212671, 0.715160, 0.072169])
"""Weights of red, green and blue, Mitsuba's (sRGB primaries)."""

LOWEST = -0.3
"""Sine of the lowest elevation that ambient light comes from. Past the plate's sides slopes that look outward
are lit from below its plane: without that light the gradient of a 1.5 mm relief under ambient light alone is
24 % off, from -0.15 up 7 %, from -0.3 up it is within the 5 % noise of finite differences."""

HORIZON = 1e-4
"""Least sine of the elevation of a light that stands for others, up or down."""
ORTHOGONAL = 1e-4
"""Tolerance of the products of an environment map's axes, of length 1."""


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
    azimuth = turn + GOLDEN_ANGLE * index
    planar = np.sqrt(1.0 - z * z)
    toward = np.stack((planar * np.cos(azimuth), planar * np.sin(azimuth), z), axis=1)
    share = np.full(count, 2.0 * np.pi * (1.0 - LOWEST) / count)
    return ParallelLights(
        off_horizon(toward), np.multiply.outer(share, np.asarray(radiance, dtype=np.float64))
    )


def off_horizon(toward: Array) -> Array:
    """Unit vectors (lights, 3), those in the plane of the plate tilted a little above it: a light there has
    no shadow to follow."""
    level = np.abs(toward[:, 2]) < HORIZON
    tilted = toward + np.outer(level * (HORIZON - toward[:, 2]), (0.0, 0.0, 1.0))
    return tilted / np.linalg.norm(tilted, axis=1, keepdims=True)


@dataclass(frozen=True)
class Quadrature:
    """Lights made ready to be drawn as parallel ones, as often as need be: pictures of environment maps are
    read and gathered once.

    Attributes:
        sources: for each light, what draws its parallel lights.
    """

    sources: tuple[Callable[[np.random.Generator | None], ParallelLights], ...]

    def lights(self, generator: np.random.Generator | None = None) -> ParallelLights:
        """All of them, shining together, in the order of the sources; red, green and blue."""
        drawn = [source(generator) for source in self.sources]
        toward = [np.zeros((0, 3)), *(lights.toward for lights in drawn)]
        colours = (np.broadcast_to(k.irradiance.reshape(len(k), -1), (len(k), 3)) for k in drawn)
        return ParallelLights(np.concatenate(toward), np.concatenate([np.zeros((0, 3)), *colours]))


def prepare(lights: Sequence[Light], size_mm: float, count: int) -> Quadrature:
    """Make lights of any kind ready to be drawn as parallel lights.

    Args:
        lights: of a checked scene, in whose variant Mitsuba is.
        size_mm: side of the plate.
        count: K, lights that stand for each one that is not directional.

    Raises:
        InputError: a light that has a `parallel_obstacle`, or a bad picture of an environment map.
    """
    for light in lights:
        obstacle = parallel_obstacle(light, size_mm)
        if obstacle is not None:
            raise InputError(obstacle)
    return Quadrature(tuple(_source(light, count) for light in lights))


def parallel_obstacle(light: Light, size_mm: float) -> str | None:
    """Why a light cannot be parallel lights, as element, field and reason; None if it can. Reads no file."""
    if light.kind == ENVIRONMENT:
        axes = light.to_world[:3, :3]
        if not np.allclose(axes.T @ axes, np.eye(3), atol=ORTHOGONAL):
            return f"{light.kind}: to_world: gradients are only there for a rotation"
        return None
    if light.kind not in (PARALLEL, AMBIENT, AREA):
        return (
            f"{light.kind}: gradients are only there for directional, constant, envmap and distant area light"
        )
    if light.strength is None:
        field = "irradiance" if light.kind == PARALLEL else "radiance"
        return f"{light.kind}: {field}: gradients are only there for a number or an rgb colour"
    return _area_obstacle(light, size_mm) if light.kind == AREA else None


def _area_obstacle(light: Light, size_mm: float) -> str | None:
    from visual.lights.area import DISTANT, is_distant, shape_obstacle

    if light.shape is None:
        return f"{light.kind}: is not on a shape"
    obstacle = shape_obstacle(light.shape)
    if obstacle is not None:
        return f"{light.kind}: {obstacle}"
    if not is_distant(light.shape, size_mm):
        least = f"{DISTANT * size_mm:g} mm away, {DISTANT:g} sides of the plate"
        return f"{light.kind}: {light.shape.kind}: gradients are only there for light at least {least}"
    return None


def _source(light: Light, count: int) -> Callable[[np.random.Generator | None], ParallelLights]:
    # The other kinds of light are made of this file's.
    from visual.lights.area import area_lights
    from visual.lights.environment import environment
    from visual.lights.environment_picture import environment_picture

    if light.kind == ENVIRONMENT:
        return environment(environment_picture(light), light.to_world, count).lights
    strength = np.array(light.strength)
    if light.kind == AMBIENT:
        return partial(ambient_lights, strength, count)
    if light.kind == AREA and light.shape is not None:
        return partial(area_lights, light.shape, strength, count)
    alone = ParallelLights(np.array([light.direction]), strength[None])
    return lambda generator: alone
