"""A scene approximated by a matte plate under a lamp and an even sky, for viewers whose lamp moves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from visual.backend import variants
from visual.backend.user_settings import user_settings_kept
from visual.exact.face_shading import ShadingPoints, unshadowed
from visual.lights.kind import Light, shines
from visual.lights.near import LightSet, flat_irradiance
from visual.lights.parallel import LUMINANCE, angles
from visual.lights.quadrature import kind_of, light_obstacle
from visual.needs import MATTE, light_name
from visual.scene import Scene

TEXTURE_SIDE = 16
"""Points along a side of the plate over which the reflectance of a texture is averaged."""
ABOVE = np.array([0.0, 0.0, 1.0])
"""Unit vector toward the viewer."""
MIDDLE = np.zeros((1, 3))
"""Middle of the flat plate, mm, where light is measured."""
LOWEST_DEG = 1.0
"""Least elevation of a lamp, degrees, below which a viewer has no use for the lamp."""


@dataclass(frozen=True)
class Lamp:
    """A lamp so far away that its light is parallel, and the sky with it.

    Attributes:
        name: of the rendering condition in which the lamp shines.
        azimuth: degrees, counter-clockwise from +x.
        elevation: degrees above the plate.
        strength: radiance of a white matte plate that faces the lamp, in units of `Scene.white`.
        ambient: radiance of the even sky, in the same units.
    """

    name: str
    azimuth: float
    elevation: float
    strength: float
    ambient: float


@dataclass(frozen=True)
class MatteScene:
    """Matte plate, lamps and even sky that approximate a scene.

    Attributes:
        lamps: of the conditions of a camera, at least one.
        albedo: reflectance, luminance, of the matte plate that is as bright as the scene's where both are
            flat, fully lit and seen from above.
        glossy: whether the scene's material has a highlight, which the matte plate lacks.
        textured: whether the scene's material varies over the plate; `albedo` is its mean.
        simplified: whether the light is simpler than the scene's: of a light that is not parallel, such as a
            sky, that part is a lamp which comes from its mean direction.
    """

    lamps: tuple[Lamp, ...]
    albedo: float
    glossy: bool
    textured: bool
    simplified: bool


@user_settings_kept
def matte_scene(scene: Scene) -> MatteScene:
    """Matte plate that approximates a scene; lights without gradients (`light_obstacle`) are left out."""
    variants.use(scene.variant)
    described, side_mm = scene.description, max(scene.surface.size_mm)
    alone = [light for light in described.lights if not kind_of(light).ambient]
    around = [light for light in described.lights if kind_of(light).ambient]
    lights = [light for light in described.lights if light_obstacle(light, side_mm) is None and shines(light)]
    sets = {light.node: scene.illumination(light) for light in lights}
    sky = sum(_irradiance(sets[light.node]) for light in around if light.node in sets)
    lamps = [
        _lamp(light_name(light, number), light, sets[light.node])
        for number, light in enumerate(alone)
        if light.node in sets
    ]
    shining = [replace(lamp, ambient=lamp.ambient + sky) for lamp in lamps if lamp.elevation > LOWEST_DEG]
    # Ambient light alone has no lamp to move, so that half of it becomes one.
    shining = shining or [Lamp("ambient", 135.0, 45.0, 0.5 * sky / np.sin(np.pi / 4.0), 0.5 * sky)]
    unit = np.pi * scene.white
    return MatteScene(
        tuple(replace(lamp, strength=lamp.strength / unit, ambient=lamp.ambient / unit) for lamp in shining),
        _flat_albedo(scene, list(sets.values())),
        glossy=not set(described.plate.material) <= set(MATTE),
        textured=bool(described.plate.textures),
        simplified=len(lights) < len(described.lights)
        or not lamps
        or not all(kind_of(light).directed for light in alone)
        or any(light.filename is not None for light in around),
    )


def _irradiance(lights: LightSet) -> float:
    """Luminance of the irradiance of a flat plate at its middle."""
    return float((flat_irradiance(lights, MIDDLE) @ LUMINANCE).sum())


def _lamp(name: str, light: Light, lights: LightSet) -> Lamp:
    """The lamp of a light, in units of irradiance.

    One that is not parallel shines from where most of its light comes, with the share that a mean of unit
    vectors has of 1; the rest is sky.
    """
    count = len(lights)
    strength = lights.strength @ LUMINANCE
    toward = np.concatenate([lights.toward_from(k, MIDDLE).reshape(1, 3) for k in range(count)])
    mean = strength @ toward / max(float(strength.sum()), np.finfo(np.float64).tiny)
    azimuth, elevation = angles(mean / max(float(np.linalg.norm(mean)), np.finfo(np.float64).tiny))
    if kind_of(light).directed:
        return Lamp(name, azimuth, elevation, float(strength.sum()), 0.0)
    share, flat = float(np.linalg.norm(mean)), _irradiance(lights)
    upright = max(float(np.sin(np.radians(elevation))), 1e-3)
    return Lamp(name, azimuth, elevation, share * flat / upright, (1.0 - share) * flat)


def _flat_albedo(scene: Scene, sets: Sequence[LightSet]) -> float:
    """Radiance of the flat plate over that of a white matte one under the same lights; 0.5 in the dark."""
    white = sum(_irradiance(lights) for lights in sets) / np.pi
    if white <= 0.0:
        return 0.5
    side = (np.arange(TEXTURE_SIDE) + 0.5) / TEXTURE_SIDE
    uv = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    level, places = np.zeros(len(uv)), ShadingPoints(np.zeros((len(uv), 3)), uv)
    bsdf = scene.light_scenes()[0].bsdf
    radiance = [unshadowed(bsdf, level, level, lights, ABOVE, places) for lights in sets]
    return float(sum(each.mean(axis=1).sum() for each in radiance)) / white
