"""Shading: radiance of faces toward a camera, and its derivatives by their slopes and by their rise."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from relief.ground.arrays import Array
from visual.backend.mitsuba import dr, mi
from visual.lights.near import LightSet
from visual.lights.parallel import LUMINANCE


@dataclass(frozen=True)
class Shading:
    """Unshadowed radiance of every face under every light, and its derivatives by the face's slopes.

    Attributes:
        radiance, by_slope_x, by_slope_y: (lights, faces).
        by_rise: the same by the rise of the face, 1/mm; None if `ShadingPoints.slide` was not given.
    """

    radiance: Array
    by_slope_x: Array
    by_slope_y: Array
    by_rise: Array | None = None


class ShadingPoints(NamedTuple):
    """Places on faces where radiance is wanted: near lights and textures differ from place to place.

    Attributes:
        points: (faces, 3) mm.
        uv: (faces, 2) texture coordinates; None if the material has no textures.
        slide: (faces, 3) motion of the points that a camera ray meets as the face rises, mm per mm; None if
            derivatives by it are not wanted.
        uv_slide: (faces, 2) the same of the texture coordinates, 1/mm; None without `uv` or `slide`.
    """

    points: Array
    uv: Array | None = None
    slide: Array | None = None
    uv_slide: Array | None = None


_ORIGIN = ShadingPoints(np.zeros((1, 3)))


def shade(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: LightSet,
    toward_camera: Array,
    places: ShadingPoints = _ORIGIN,
) -> Shading:
    """Evaluate a Mitsuba BSDF on faces of given slopes, with derivatives by Dr.Jit's forward mode.

    Args:
        bsdf: the plate's material; of coloured radiance the luminance is taken.
        slope_x, slope_y: (faces,) dz/dx and dz/dy.
        lights: shine together.
        toward_camera: unit vector (3,), or one for each face (faces, 3).
        places: on the faces; without meaning for parallel lights and no textures.

    Returns:
        All (lights, faces).
    """
    variables, radiance = _radiance(bsdf, slope_x, slope_y, lights, toward_camera, places)
    results = []
    for which in range(2 if places.slide is None else 3):
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
    lights: LightSet,
    toward_camera: Array,
    places: ShadingPoints = _ORIGIN,
) -> Array:
    """Radiance (lights, faces) without its derivatives; arguments as of `shade`."""
    if len(slope_x) == 0:
        return np.zeros((len(lights), 0))
    variables, radiance = _radiance(bsdf, slope_x, slope_y, lights, toward_camera, places)
    return np.asarray(radiance(*variables), dtype=np.float64).reshape(len(lights), len(slope_x))


def _radiance(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: LightSet,
    toward_camera: Array,
    places: ShadingPoints,
) -> tuple[list[Any], Callable[..., Any]]:
    """Slopes and rises as Dr.Jit arrays, light by light, and the function to radiance."""
    count, faces = len(lights), len(slope_x)
    camera = _tiled(np.atleast_2d(toward_camera), count)
    points = mi.Vector3f(*_tiled(places.points, count))
    slide = None if places.slide is None else mi.Vector3f(*_tiled(places.slide, count))
    uv = None if places.uv is None else mi.Point2f(*_tiled(places.uv, count))
    uv_slide = None if places.uv_slide is None else mi.Vector2f(*_tiled(places.uv_slide, count))
    colours = np.broadcast_to(lights.strength.reshape(count, -1), (count, 3))
    strengths = (colours @ LUMINANCE)[:, None] if mi.is_monochromatic else colours
    full = [mi.Float(np.repeat(s, faces).astype(np.float32)) for s in strengths.T]

    def radiance(p: Any, q: Any, rise: Any) -> Any:
        frame = mi.Frame3f(dr.normalize(mi.Vector3f(-p, -q, 1.0)))
        si = dr.zeros(mi.SurfaceInteraction3f, count * faces)
        if uv is not None:
            si.uv = uv if uv_slide is None else uv + rise * uv_slide
            along_u = dr.normalize(mi.Vector3f(1.0, 0.0, p))
            frame = mi.Frame3f(along_u, mi.Vector3f(dr.cross(frame.n, along_u)), mi.Vector3f(frame.n))
        si.n, si.sh_frame, si.wi = frame.n, frame, frame.to_local(mi.Vector3f(*camera))
        toward, share = lights.arriving(points if slide is None else points + rise * slide, faces)
        value = bsdf.eval(mi.BSDFContext(), si, frame.to_local(toward))
        irradiance = [strength * share for strength in full]
        return (
            value[0] * irradiance[0] if mi.is_monochromatic else mi.luminance(value * mi.Color3f(irradiance))
        )

    slopes = [mi.Float(np.tile(v, count).astype(np.float32)) for v in (slope_x, slope_y)]
    return [*slopes, dr.zeros(mi.Float, count * faces)], radiance


def _tiled(vectors: Array, count: int) -> list[Any]:
    """Components of vectors (faces, n), so many times one after the other; of one vector if all are alike."""
    alike = not np.ptp(vectors, axis=0).any()
    chosen = vectors[:1] if alike else np.tile(vectors, (count, 1))
    return [mi.Float(np.ascontiguousarray(component)) for component in chosen.T.astype(np.float32)]
