"""Conversion of a loaded scene into a fast renderer: materials are tabulated once, by Mitsuba."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from relief.surface import Surface
from visual.fast.ambient_net import AmbientLight, UnoccludedLight, trained_ambient_light
from visual.fast.bsdf_table import ambient_table, light_table
from visual.fast.renderer import FastRenderer, FilmWeights
from visual.lights.kind import RGB
from visual.lights.parallel import ParallelLights

LEAST_RADIANCE = 1e-9
"""Least radiance of ambient light that is not left out: below it no picture changes visibly."""


def fast_renderer(
    surface: Surface,
    rise_mm: float,
    bsdf: Any,
    lights: Sequence[ParallelLights],
    ambient: RGB,
    film: tuple[FilmWeights, FilmWeights] | None = None,
    shadows: bool = True,
) -> FastRenderer:
    """The fast renderer of a plate seen from straight above.

    Args:
        surface: of the plate.
        rise_mm: expected from the lowest to the highest point of its reliefs.
        bsdf: the plate's material in Mitsuba's current variant.
        lights: what shines in each condition; with none, the one condition is ambient light alone.
        ambient: radiance from all around, added to every condition; red, green and blue.
        film: weights of the film along y and x; None for a box and one pixel at each sample.
        shadows: whether the plate casts shadows on itself and hides ambient light from itself.

    Raises:
        InputError: there is no net for ambient light on this material.
    """
    toward, irradiance = (
        np.concatenate([getattr(alone, name) for alone in lights]) if lights else np.zeros((0, 3))
        for name in ("toward", "irradiance")
    )
    around: AmbientLight | UnoccludedLight | None = None
    if max(ambient) > LEAST_RADIANCE:
        table = ambient_table(bsdf, np.array(ambient))
        around = trained_ambient_light(table) if shadows else UnoccludedLight(table)
    return FastRenderer(
        surface,
        tuple((float(x), float(y), float(z)) for x, y, z in toward),
        tuple(number for number, alone in enumerate(lights) for _ in alone.toward),
        max(len(lights), 1),
        light_table(bsdf, ParallelLights(toward, irradiance)) if len(toward) else None,
        around,
        film,
        shadows,
        rise_mm,
    )
