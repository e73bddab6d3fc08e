"""Shading: radiance of faces toward a camera under parallel lights, and its derivatives by their slopes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from relief.arrays import Array
from visual.lights.parallel import LUMINANCE, ParallelLights


@dataclass(frozen=True)
class Shading:
    """Unshadowed radiance of every face under every light, and its derivatives by the face's slopes.

    Attributes:
        radiance, by_slope_x, by_slope_y: (lights, faces).
    """

    radiance: Array
    by_slope_x: Array
    by_slope_y: Array


def shade(bsdf: Any, slope_x: Array, slope_y: Array, lights: ParallelLights, toward_camera: Array) -> Shading:
    """Evaluate a Mitsuba BSDF on faces of given slopes, with derivatives by Dr.Jit's forward mode.

    Args:
        bsdf: the plate's material; of coloured radiance the luminance is taken.
        slope_x, slope_y: (faces,) dz/dx and dz/dy.
        lights: parallel lights.
        toward_camera: unit vector (3,), or one for each face (faces, 3).

    Returns:
        All (lights, faces).
    """
    import drjit as dr

    p, q, radiance = _radiance(bsdf, slope_x, slope_y, lights, toward_camera)
    results = []
    for which in (0, 1):
        slopes = [type(p)(p), type(q)(q)]
        dr.enable_grad(slopes[which])
        value = radiance(*slopes)
        dr.forward(slopes[which])
        derivative = dr.grad(value)
        dr.eval(value, derivative)
        results.append(derivative)
    shape = (len(lights), len(slope_x))
    value, by_x, by_y = (np.asarray(v, dtype=np.float64).reshape(shape) for v in (dr.detach(value), *results))
    return Shading(value, by_x, by_y)


def unshadowed(
    bsdf: Any, slope_x: Array, slope_y: Array, lights: ParallelLights, toward_camera: Array
) -> Array:
    """Radiance (lights, faces) without its derivatives; arguments as of `shade`."""
    p, q, radiance = _radiance(bsdf, slope_x, slope_y, lights, toward_camera)
    return np.asarray(radiance(p, q), dtype=np.float64).reshape(len(lights), len(slope_x))


def _radiance(
    bsdf: Any, slope_x: Array, slope_y: Array, lights: ParallelLights, toward_camera: Array
) -> tuple[Any, Any, Callable[[Any, Any], Any]]:
    """Slopes as Dr.Jit arrays, light by light, and the function from such slopes to radiance."""
    import drjit as dr
    import mitsuba as mi

    count, faces = len(lights), len(slope_x)
    view = np.atleast_2d(toward_camera)
    if not np.ptp(view, axis=0).any():
        view = view[:1]
    p = mi.Float(np.tile(slope_x, count).astype(np.float32))
    q = mi.Float(np.tile(slope_y, count).astype(np.float32))
    toward = mi.Vector3f(
        *(mi.Float(np.repeat(lights.toward[:, a], faces).astype(np.float32)) for a in range(3))
    )
    colours = np.broadcast_to(lights.irradiance.reshape(count, -1), (count, 3))
    strengths = (colours @ LUMINANCE)[:, None] if mi.is_monochromatic else colours
    irradiance = [mi.Float(np.repeat(s, faces).astype(np.float32)) for s in strengths.T]
    camera = mi.Vector3f(
        *(mi.Float(np.tile(c, count if len(c) > 1 else 1).astype(np.float32)) for c in view.T)
    )

    def radiance(p: Any, q: Any) -> Any:
        frame = mi.Frame3f(dr.normalize(mi.Vector3f(-p, -q, 1.0)))
        si = dr.zeros(mi.SurfaceInteraction3f, count * faces)
        si.n, si.sh_frame, si.wi = frame.n, frame, frame.to_local(camera)
        value = bsdf.eval(mi.BSDFContext(), si, frame.to_local(toward))
        return (
            value[0] * irradiance[0] if mi.is_monochromatic else mi.luminance(value * mi.Color3f(irradiance))
        )

    return p, q, radiance
