"""Shading: radiance of faces toward a camera under parallel lights, and its derivatives by their slopes."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from relief.common.arrays import Array
from visual.backend.mitsuba import dr, mi
from visual.lights.parallel import LUMINANCE, ParallelLights


@dataclass(frozen=True)
class Shading:
    """Unshadowed radiance of every face under every light, and its derivatives by the face's slopes.

    Attributes:
        radiance, by_slope_x, by_slope_y: (lights, faces).
        by_u, by_v: the same by texture coordinates; None if they were not wanted.
    """

    radiance: Array
    by_slope_x: Array
    by_slope_y: Array
    by_u: Array | None = None
    by_v: Array | None = None


def shade(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: ParallelLights,
    toward_camera: Array,
    uv: Array | None = None,
    by_uv: bool = False,
) -> Shading:
    """Evaluate a Mitsuba BSDF on faces of given slopes, with derivatives by Dr.Jit's forward mode.

    Args:
        bsdf: the plate's material; of coloured radiance the luminance is taken.
        slope_x, slope_y: (faces,) dz/dx and dz/dy.
        lights: parallel lights.
        toward_camera: unit vector (3,), or one for each face (faces, 3).
        uv: (faces, 2) texture coordinates; None if the material has no textures.
        by_uv: whether derivatives by texture coordinates are wanted.

    Returns:
        All (lights, faces).
    """
    variables, radiance = _radiance(bsdf, slope_x, slope_y, lights, toward_camera, uv)
    results = []
    for which in range(4 if by_uv else 2):
        attached = [type(values)(values) for values in variables]
        dr.enable_grad(attached[which])
        value = radiance(*attached)
        dr.forward(attached[which])
        derivative = dr.grad(value)
        dr.eval(value, derivative)
        results.append(derivative)
    shape = (len(lights), len(slope_x))
    return Shading(*(np.asarray(v, dtype=np.float64).reshape(shape) for v in (dr.detach(value), *results)))


def unshadowed(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: ParallelLights,
    toward_camera: Array,
    uv: Array | None = None,
) -> Array:
    """Radiance (lights, faces) without its derivatives; arguments as of `shade`."""
    if len(slope_x) == 0:
        return np.zeros((len(lights), 0))
    variables, radiance = _radiance(bsdf, slope_x, slope_y, lights, toward_camera, uv)
    return np.asarray(radiance(*variables), dtype=np.float64).reshape(len(lights), len(slope_x))


def _radiance(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: ParallelLights,
    toward_camera: Array,
    uv: Array | None,
) -> tuple[list[Any], Callable[..., Any]]:
    """Slopes (and texture coordinates) as Dr.Jit arrays, light by light, and the function to radiance."""
    count, faces = len(lights), len(slope_x)
    view = np.atleast_2d(toward_camera)
    if not np.ptp(view, axis=0).any():
        view = view[:1]
    coordinates = () if uv is None else uv.T
    variables = [mi.Float(np.tile(v, count).astype(np.float32)) for v in (slope_x, slope_y, *coordinates)]
    toward = mi.Vector3f(
        *(mi.Float(np.repeat(lights.toward[:, a], faces).astype(np.float32)) for a in range(3))
    )
    colours = np.broadcast_to(lights.irradiance.reshape(count, -1), (count, 3))
    strengths = (colours @ LUMINANCE)[:, None] if mi.is_monochromatic else colours
    irradiance = [mi.Float(np.repeat(s, faces).astype(np.float32)) for s in strengths.T]
    camera = mi.Vector3f(
        *(mi.Float(np.tile(c, count if len(c) > 1 else 1).astype(np.float32)) for c in view.T)
    )

    def radiance(p: Any, q: Any, *uv: Any) -> Any:
        frame = mi.Frame3f(dr.normalize(mi.Vector3f(-p, -q, 1.0)))
        si = dr.zeros(mi.SurfaceInteraction3f, count * faces)
        if uv:
            si.uv = mi.Point2f(*uv)
            along_u = dr.normalize(mi.Vector3f(1.0, 0.0, p))
            frame = mi.Frame3f(along_u, mi.Vector3f(dr.cross(frame.n, along_u)), mi.Vector3f(frame.n))
        si.n, si.sh_frame, si.wi = frame.n, frame, frame.to_local(camera)
        value = bsdf.eval(mi.BSDFContext(), si, frame.to_local(toward))
        return (
            value[0] * irradiance[0] if mi.is_monochromatic else mi.luminance(value * mi.Color3f(irradiance))
        )

    return variables, radiance
