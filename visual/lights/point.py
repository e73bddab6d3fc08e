"""Lights that shine from one point: alike in all directions, or in a cone with a soft edge."""

import math
from functools import partial
from typing import Any

import numpy as np

from visual.backend.mitsuba import dr
from visual.lights.kind import UNSAMPLED, Draw, Light, LightKind
from visual.lights.near import Lobe, NearLights, even, off_plate, too_near

NARROWEST_EDGE = 1.0
"""Least width, degrees, of the edge of a cone that has gradients: at 20 mm three samples of a plate of 128
over 10 mm, so that light varies little over one face."""


def cone_lobe(bright: float, dark: float) -> Lobe:
    """The lobe of a cone, by Mitsuba's rule.

    Args:
        bright, dark: angles to the axis, degrees, up to which the light is full, and from which it is 0;
            between them it falls in proportion to the angle.
    """
    edge, width, along = math.radians(dark), math.radians(dark - bright), 1.0 - 1e-6

    def lobe(cosine: Any) -> Any:
        # Along the axis itself the arc cosine has no derivative.
        angle = dr.acos(dr.minimum(cosine, along))
        return dr.clip((edge - angle) / width, 0.0, 1.0)

    return lobe


def _quadrature(light: Light, count: int, size_mm: float) -> Draw:
    lobe = even if light.cone is None else cone_lobe(*light.cone)
    axis = light.to_world[:3, 2] / np.linalg.norm(light.to_world[:3, 2])
    alone = NearLights(light.to_world[:3, 3][None], np.array(light.strength)[None], axis[None], lobe)
    return lambda generator: alone


def _obstacle(light: Light, size_mm: float) -> str | None:
    if light.cone is not None and light.cone[1] - light.cone[0] < NARROWEST_EDGE:
        least = f"{NARROWEST_EDGE:g} degree less than cutoff_angle"
        return f"beam_width: gradients are only there for a soft edge, at least {least}"
    return too_near(off_plate(light.to_world[None, :3, 3], size_mm), size_mm)


_AT_ONE_POINT = partial(
    LightKind,
    strength="intensity",
    quadrature=_quadrature,
    obstacle=_obstacle,
    near=lambda light, size_mm: True,
    switch=UNSAMPLED,
)
POINT = _AT_ONE_POINT(lambda light: "point light")
SPOT = _AT_ONE_POINT(lambda light: "spotlight", cone=True)
