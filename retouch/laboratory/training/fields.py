"""Fields of touch and sight, many reliefs at a time: the training data of nets."""

from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch

import mitsuba_scenes
import tactile
from relief.ground.arrays import AnyArray
from relief.relief import Relief
from visual.reference.reference_renderer import ReferenceRenderer
from visual.scene import Scene
from visual.scene_file.check import check_scene

LightRule = Literal["studio", "random"]

STUDIO = Path(str(mitsuba_scenes.__file__)).with_name("studio.xml")
"""Scene file with the material and the camera of the pictures."""
STUDIO_ELEVATION, STUDIO_AZIMUTHS = 35.0, (10.0, 130.0, 250.0)
"""Elevation and azimuths of the studio's parallel lights, degrees (paper 5.1)."""
LOWEST_ELEVATION, HIGHEST_ELEVATION = 10.0, 80.0
"""Elevations of random lights, degrees; below, hardly more than the rims of a relief of 3 mm is lit."""
VARIANT = "llvm_ad_mono"
"""Variant of Mitsuba, named, so that the data are the same everywhere."""
BATCH = 16
"""Reliefs pressed at a time; larger batches are no faster."""


def touch_fields(
    heights: AnyArray, size_mm: float, skin: tactile.Skin, model: Literal["layer", "fem"]
) -> dict[str, AnyArray]:
    """Press the skin on reliefs, in double precision.

    Args:
        heights: (n, s, s) mm.
        size_mm: Side of the plate, mm.
        skin: The skin.
        model: Model of touch.

    Returns:
        strain, gap, pressure: (n, s, s) float32, as of `tactile.Touch`. roughness (the full sum),
        contact_area_mm2, contact_fraction: (n,) float64.

    Raises:
        tactile.ContactError: A contact did not converge.
        tactile.InputError: Some heights are not finite.
    """
    parts: list[dict[str, AnyArray]] = []
    for first in range(0, len(heights), BATCH):
        batch = torch.as_tensor(np.asarray(heights[first : first + BATCH], dtype=np.float64))
        touch = tactile.press(batch, size_mm, skin, model)
        parts.append(
            {
                "strain": touch.strain.numpy().astype(np.float32),
                "gap": touch.gap.clamp_min(0.0).numpy().astype(np.float32),
                "pressure": touch.pressure.numpy().astype(np.float32),
                # Single precision is within 1e-6 of double, in half the time.
                "roughness": tactile.roughness(touch.strain.float(), size_mm).double().numpy(),
                "contact_area_mm2": tactile.contact_area(touch.gap, size_mm).numpy(),
                "contact_fraction": touch.contact_fraction.numpy(),
            }
        )
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def picture_fields(heights: AnyArray, toward: AnyArray, strata: int, seed: int) -> dict[str, AnyArray]:
    """Compute pictures of one relief in the studio's material, from above, a pixel at each sample.

    Light is linear: the picture under several lights is the sum of these pictures, each times its strength.

    Args:
        heights: (s, s) mm, over 10 x 10 mm.
        toward: (lights, 3) unit vectors toward parallel lights.
        strata: Shadow rays along a pixel's side where light and shadow meet.
        seed: Seed of the azimuths that ambient light is summed over.

    Returns:
        pictures: (lights, s, s) float32 radiance under each light alone, irradiance pi on a plane that faces
        it; ambient: (s, s) float32 radiance under ambient light of radiance 1. A white matte plate that faces
        the light, or lies flat under the sky, has radiance 1.
    """
    renderer, field = _studio(heights.shape[-1], strata), np.asarray(heights, dtype=np.float64)
    return {
        "pictures": renderer.parallel_pictures(field, toward).astype(np.float32),
        "ambient": renderer.ambient_picture(field, seed).astype(np.float32),
    }


def light_directions(rule: LightRule, count: int, seed: int) -> AnyArray:
    """Return unit vectors (count, 3) toward parallel lights.

    Args:
        rule: "studio", the paper's three lights; "random", elevation uniform in 10 to 80 degrees.
        count: Number of lights.
        seed: Seed of random lights.

    Raises:
        ValueError: The studio has another number of lights.
    """
    if rule == "studio":
        if count != len(STUDIO_AZIMUTHS):
            raise ValueError(f"the studio has {len(STUDIO_AZIMUTHS)} lights, not {count}")
        elevation, azimuth = np.full(count, STUDIO_ELEVATION), np.array(STUDIO_AZIMUTHS)
    else:
        random = np.random.default_rng(seed)
        elevation = random.uniform(LOWEST_ELEVATION, HIGHEST_ELEVATION, count)
        azimuth = random.uniform(0.0, 360.0, count)
    elevation, azimuth = np.radians(elevation), np.radians(azimuth)
    level = np.cos(elevation)
    return np.stack((level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)), axis=1)


@lru_cache(maxsize=2)
def _studio(samples: int, strata: int) -> ReferenceRenderer:
    """Load the studio once; only heights and lights change afterwards."""
    return ReferenceRenderer(_studio_scene(samples), strata)


def studio_material() -> Any:
    """Return the Mitsuba BSDF of the plate in the paper's studio, which belongs to `VARIANT`.

    A caller decorated by `user_settings_kept` has that variant until its own end.
    """
    return _studio_scene(16).light_scenes()[0].bsdf


def _studio_scene(samples: int) -> Scene:
    """The paper's studio with a flat plate."""
    checked = check_scene(STUDIO, {"resolution": str(samples)})
    return Scene(checked, Relief(np.zeros((samples, samples))), VARIANT)
