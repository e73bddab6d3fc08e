"""Pictures of bodies from several sides under several lights, by Mitsuba, and how much they change."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optimize.verification.jod import jod
from optimize.verification.picture_change import change
from optimize.verification.picture_metrics import pixels_per_degree
from relief.ground.arrays import Array
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from visual.backend.variants import choose_variant
from visual.picture_noise import BATCHES, Batches

VIEWS = {
    "above": (0.0, 89.9),
    "front": (-90.0, 40.0),
    "right": (0.0, 40.0),
    "back": (90.0, 40.0),
    "left": (180.0, 40.0),
}
"""Where the camera stands: azimuth from +x and elevation, degrees."""
LIGHTS = {"high": (150.0, 50.0), "low": (40.0, 25.0)}
"""Where the sun of each light stands, as the camera does."""
SUN, SKY = 2.4, 0.25
"""Irradiance of the sun, and radiance of the sky."""
DISTANCE_MM = 300.0
"""From the eye to the middle of the object: in the paper, people sit 30 cm away."""
MARGIN = 1.04
"""Width of the picture over the diameter of the object's bounding ball."""
SIZE = 256
"""Pixels along a side of a picture."""
SUN_SAMPLES, SKY_SAMPLES = 4, 16
"""Samples of a pixel in each batch. Sun and sky are rendered apart and added: a path that chose between them
would be far noisier. One picture of the sky serves all lights."""
REFLECTANCE = 0.6
"""Reflectance of the matte material."""


@dataclass(frozen=True)
class Pictures:
    """Pictures of one body without a floor.

    Attributes:
        batches: (batches, lights, views, rows, cols) radiance; 0 where the body is not.
        cover: (views, rows, cols) part of each pixel that the body covers.
        pixels_per_mm: in the middle of the body.
    """

    batches: Array
    cover: Array
    pixels_per_mm: float

    @property
    def radiance(self) -> Array:
        """(lights, views, rows, cols) mean radiance of the batches."""
        return np.asarray(self.batches.mean(axis=0))


def direction(azimuth: float, elevation: float) -> Array:
    """(3,) unit vector towards an azimuth from +x and an elevation, degrees."""
    turn, up = np.radians([azimuth, elevation])
    return np.array([np.cos(turn) * np.cos(up), np.sin(turn) * np.cos(up), np.sin(up)])


def pictures(
    body: Body,
    frame: Body,
    views: Mapping[str, tuple[float, float]] = VIEWS,
    lights: Mapping[str, tuple[float, float]] = LIGHTS,
    size: int = SIZE,
) -> Pictures:
    """Render a body in matte material, one bounce of light, with one sun and an even sky for each light.

    Args:
        body: That is seen, mm.
        frame: The body that the cameras are set by: the object without texture, so that pictures of several
            textures on it have one frame.
        views, lights: Where cameras and suns stand.
        size: Pixels along a side.
    """
    import mitsuba as mi

    mi.set_variant(choose_variant(colour=False).name)
    middle = 0.5 * (frame.vertices.min(axis=0) + frame.vertices.max(axis=0))
    half = MARGIN * float(np.linalg.norm(frame.vertices - middle, axis=1).max())
    with tempfile.TemporaryDirectory() as folder:
        path = write_parts(Path(folder) / "body.ply", [Part("body", body)])
        matte = {"type": "diffuse", "reflectance": REFLECTANCE}
        solid = mi.load_dict({"type": "ply", "filename": str(path), "face_normals": True, "bsdf": matte})
    sensors = [_sensor(middle, at, half, size) for at in views.values()]

    def lit(emitter: dict[str, Any], samples: int) -> Array:
        """(batches, views, rows, cols, 2) radiance and cover under one emitter."""
        path = {"type": "path", "max_depth": 2, "hide_emitters": True}
        scene = mi.load_dict({"type": "scene", "integrator": path, "body": solid, "light": emitter})
        found = [
            [np.asarray(mi.render(scene, sensor=one, spp=samples, seed=mi.UInt32(seed))) for one in sensors]
            for seed in range(BATCHES)
        ]
        return np.asarray(found, dtype=np.float64)

    sky = lit({"type": "constant", "radiance": SKY}, SKY_SAMPLES)
    suns = [
        lit({"type": "directional", "direction": (-direction(*at)).tolist(), "irradiance": SUN}, SUN_SAMPLES)
        for at in lights.values()
    ]
    radiance = sky[:, None, ..., 0] + np.stack(suns, axis=1)[..., 0]
    return Pictures(radiance, sky[..., 1].mean(axis=0), 0.5 * size / half)


def _sensor(middle: Array, at: tuple[float, float], half: float, size: int) -> Any:
    """A camera that looks at a point, and sees as far as `half` mm around it."""
    import mitsuba as mi

    film = {
        "width": size,
        "height": size,
        "pixel_format": "luminance_alpha",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    fov = float(2.0 * np.degrees(np.arctan(half / DISTANCE_MM)))
    return mi.load_dict(perspective(middle + DISTANCE_MM * direction(*at), middle, fov, SKY_SAMPLES, film))


def perspective(
    origin: Array, target: Array, fov: float, samples: int, film: Mapping[str, Any]
) -> dict[str, Any]:
    """Mitsuba's description of an upright camera; one that looks down has +y above.

    Args:
        origin: (3,) where the camera stands, mm.
        target: (3,) the point in the middle of the picture, mm.
        fov: Angle of view across the picture, degrees.
        samples: Samples a pixel.
        film: Mitsuba's description of the film, without its type.
    """
    import mitsuba as mi

    way = origin - target
    up = [0.0, 1.0, 0.0] if way[2] > 0.985 * np.linalg.norm(way) else [0.0, 0.0, 1.0]
    return {
        "type": "perspective",
        "fov": fov,
        "to_world": mi.ScalarTransform4f().look_at(origin.tolist(), target.tolist(), up),
        "film": {"type": "hdrfilm", **film},
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


def change_percent(before: Pictures, after: Pictures) -> Array:
    """(lights, views) mean absolute change of the pictures of an object, % of their mean before.

    Both means are over the pixels that the object covers in both. Noise is accounted for as in a run.
    """
    inside = np.minimum(before.cover, after.cover) > 0.999
    lights, views = before.batches.shape[1:3]
    found = np.zeros((lights, views))
    for light in range(lights):
        for view in range(views):
            one, other = (each.batches[:, light, view][:, None, inside[view]] for each in (before, after))
            apart = change(Batches(one, SKY_SAMPLES), Batches(other, SKY_SAMPLES))
            found[light, view] = 100.0 * apart.estimate / one.mean()
    return found


def jod_of(before: Pictures, after: Pictures, distance_cm: float) -> Array:
    """(lights, views) JOD of the pictures of an object from this distance; 10 is identical."""
    sharpness = pixels_per_degree(before.pixels_per_mm, distance_cm)
    white = float(np.percentile(before.radiance[:, before.cover > 0.999], 99.7))
    return np.array(
        [
            [jod(*pair, white, sharpness) for pair in zip(*lit, strict=True)]
            for lit in zip(before.radiance, after.radiance, strict=True)
        ]
    )
