"""Directional light: one parallel light."""

import numpy as np

from visual.lights.kind import UNSAMPLED, Draw, Light, LightKind
from visual.lights.parallel import OVERHEAD, ParallelLights, angles


def _quadrature(light: Light, count: int, size_mm: float) -> Draw:
    alone = ParallelLights(np.array([light.direction]), np.array(light.strength)[None])
    return lambda generator: alone


def _casts_shadows(light: Light) -> bool:
    assert light.direction is not None
    x, y, z = light.direction
    return bool(z < 0.0 or np.hypot(x, y) > OVERHEAD)


def _words(light: Light) -> str:
    if light.direction is None or not _casts_shadows(light):
        return "parallel light from straight above"
    azimuth, elevation = angles(light.direction)
    return f"parallel light, azimuth {azimuth:g}°, elevation {elevation:g}°"


DIRECTIONAL = LightKind(
    _words, "irradiance", _quadrature, directed=True, casts_shadows=_casts_shadows, switch=UNSAMPLED
)
