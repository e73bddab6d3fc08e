"""A quick look at a scene: what of it torch alone can show, taken over from Mitsuba once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from relief.errors import InputError
from visual.backend.plate import plate_bsdf
from visual.fast.ambient_net import trained_ambient_light
from visual.fast.bsdf_table import ambient_table, light_table
from visual.fast.renderer import FastRenderer
from visual.lights.parallel import ParallelLights
from visual.needs import Needs

if TYPE_CHECKING:
    from visual.scene import Scene

LEAST_RADIANCE = 1e-9
"""Of ambient light that is worth a net."""


def quick_look(path: Path, scene: Scene, needs: Needs, ambient: tuple[float, float, float]) -> FastRenderer:
    """The quick look of a loaded scene, in whose variant Mitsuba is.

    Args:
        path: of the scene, for messages.
        ambient: radiance of the constant light from all around, red, green and blue.

    Raises:
        InputError: what of the scene it cannot show, or that it has no net for its ambient light.
    """
    rows, cols = scene.heights.shape
    if needs.top_view != (True,) or scene.resolution != (rows, cols) or rows != cols:
        raise InputError(
            f"{path}: sensor: the rendering net looks from straight above, with one pixel at each of "
            f"{rows} x {cols} height samples; use exact"
        )
    if not needs.direct:
        raise InputError(f"{path}: integrator: the rendering net knows direct light only; use exact")
    bsdf = plate_bsdf(scene.light_scenes()[0].scene)
    sets = [scene.illumination(light) for light in needs.alone]
    toward, irradiance = (
        np.concatenate([getattr(lights, name) for lights in sets]) if sets else np.zeros((0, 3))
        for name in ("toward", "irradiance")
    )
    sky = None
    if needs.around and max(ambient) > LEAST_RADIANCE:
        sky = trained_ambient_light(ambient_table(bsdf, np.array(ambient)), rows)
    conditions = max(len(sets), 1)
    condition = [number for number, lights in enumerate(sets) for _ in lights.toward]
    return FastRenderer(
        rows,
        scene.size_mm,
        tuple((float(x), float(y), float(z)) for x, y, z in toward),
        tuple(condition),
        conditions,
        light_table(bsdf, ParallelLights(toward, irradiance)) if len(toward) else None,
        sky,
    )
