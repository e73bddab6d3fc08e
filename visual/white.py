"""Unit of radiance of a scene: that of a white matte plate under the strongest light."""

from collections.abc import Callable

import numpy as np

from visual.backend.mitsuba import mi
from visual.lights.kind import Light
from visual.lights.near import LightSet, flat_irradiance
from visual.lights.parallel import LUMINANCE
from visual.lights.quadrature import kind_of, light_obstacle
from visual.scene_file.parsed_scene import Description

SIDE_LOOKED_AT = 9
"""Points along a side of the plate among which the brightest is looked for."""


def white_radiance(
    description: Description, size_mm: float, standing_for: Callable[[Light], LightSet]
) -> float:
    """Radiance of a white matte plate under the strongest light of a scene; see `Scene.white`.

    Args:
        description: of the scene.
        size_mm: longer side of the plate.
        standing_for: gives the fixed lights that represent a light.
    """
    along = size_mm * np.linspace(-0.5, 0.5, SIDE_LOOKED_AT)
    x, y = (axis.ravel() for axis in np.meshgrid(along, along))
    plate = np.stack((x, y, np.zeros_like(x)), axis=1)
    strengths = [float(LUMINANCE @ np.array(description.ambient))]
    for light in description.lights:
        # Scalar variants have no arrays, which light from points is computed by.
        scalar = not kind_of(light).directed and str(mi.variant()).startswith("scalar")
        if kind_of(light).ambient or scalar or light_obstacle(light, size_mm) is not None:
            continue
        lights = standing_for(light)
        facing = lights.strength if kind_of(light).directed else flat_irradiance(lights, plate)
        strengths.append(float((facing @ LUMINANCE).max()) / np.pi)
    return max(strengths) or 1.0
