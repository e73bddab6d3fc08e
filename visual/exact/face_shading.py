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

    @property
    def values(self) -> list[Array]:
        """Radiance and its derivatives, as many as there are."""
        return [values for values in vars(self).values() if values is not None]


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

FixedShare = Callable[[Any, Any, Any, Any], Any]
"""Share, of Dr.Jit, of the radiance under fixed lights that counts; `visual.exact.lobes` samples the rest.
Arguments are surface interaction, direction of the light in its frame, point, and direction in space."""


class ShadedFaces:
    """Faces before a camera for Dr.Jit, so many times one after the other, differentiable by their planes.

    Attributes:
        count: times.
        faces: number of faces.
        variables: slopes dz/dx and dz/dy, and rises, mm, of which `at` is a function; all rises are 0.
    """

    def __init__(
        self, slope_x: Array, slope_y: Array, toward_camera: Array, places: ShadingPoints, count: int
    ) -> None:
        """Place the faces; arguments as of `shade`."""
        self.count, self.faces = count, len(slope_x)
        self._camera = mi.Vector3f(*_tiled(np.atleast_2d(toward_camera), count))
        self._points = mi.Vector3f(*_tiled(places.points, count))
        self._slide = None if places.slide is None else mi.Vector3f(*_tiled(places.slide, count))
        self._uv = None if places.uv is None else mi.Point2f(*_tiled(places.uv, count))
        self._uv_slide = None if places.uv_slide is None else mi.Vector2f(*_tiled(places.uv_slide, count))
        slopes = [mi.Float(np.tile(v, count).astype(np.float32)) for v in (slope_x, slope_y)]
        self.variables = [*slopes, dr.zeros(mi.Float, count * self.faces)]

    def at(self, p: Any, q: Any, rise: Any) -> tuple[Any, Any, Any]:
        """Surface interactions, shading frames and points of the faces at `variables`."""
        normal, along_u = dr.normalize(mi.Vector3f(-p, -q, 1.0)), dr.normalize(mi.Vector3f(1.0, 0.0, p))
        frame = mi.Frame3f(along_u, dr.cross(normal, along_u), normal)
        si = dr.zeros(mi.SurfaceInteraction3f, self.count * self.faces)
        if self._uv is not None:
            si.uv = self._uv if self._uv_slide is None else self._uv + rise * self._uv_slide
        si.n, si.sh_frame, si.wi = frame.n, frame, frame.to_local(self._camera)
        return si, frame, self._points if self._slide is None else self._points + rise * self._slide

    def shading(self, radiance: Callable[..., Any], derivatives: bool) -> Shading:
        """Radiance, a function of `variables`, with its derivatives by forward mode; 0 if none are wanted."""
        count, results = 2 if self._slide is None else 3, []
        if not derivatives:
            shown = self.numbers(radiance(*self.variables))
            return Shading(shown, *np.zeros((count, *shown.shape)))
        for which in range(count):
            attached = [type(values)(values) for values in self.variables]
            dr.enable_grad(attached[which])
            value = radiance(*attached)
            dr.forward(attached[which])
            derivative = dr.grad(value)
            dr.eval(value, derivative)
            results.append(derivative)
        return Shading(*map(self.numbers, (dr.detach(value), *results)))

    def numbers(self, values: Any) -> Array:
        """(count, faces) of values of Dr.Jit."""
        flat = np.broadcast_to(np.asarray(values, dtype=np.float64), self.count * self.faces)
        return np.array(flat.reshape(self.count, self.faces))


def shade(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: LightSet,
    toward_camera: Array,
    places: ShadingPoints = _ORIGIN,
    share: FixedShare | None = None,
    derivatives: bool = True,
) -> Shading:
    """Evaluate a Mitsuba BSDF on faces of given slopes, with derivatives by Dr.Jit's forward mode.

    Args:
        bsdf: the plate's material; of coloured radiance the luminance is taken.
        slope_x, slope_y: (faces,) dz/dx and dz/dy.
        lights: shine together.
        toward_camera: unit vector (3,), or one for each face (faces, 3).
        places: on the faces; without meaning for parallel lights and no textures.
        share: of the radiance that counts; None: all.
        derivatives: whether they are wanted; they are 0 if not.

    Returns:
        All (lights, faces).
    """
    faces = ShadedFaces(slope_x, slope_y, toward_camera, places, len(lights))
    return faces.shading(_radiance(bsdf, faces, lights, share), derivatives)


def unshadowed(
    bsdf: Any,
    slope_x: Array,
    slope_y: Array,
    lights: LightSet,
    toward_camera: Array,
    places: ShadingPoints = _ORIGIN,
) -> Array:
    """Radiance (lights, faces) without its derivatives; arguments as of `shade`."""
    return shade(bsdf, slope_x, slope_y, lights, toward_camera, places, derivatives=False).radiance


def _radiance(
    bsdf: Any, faces: ShadedFaces, lights: LightSet, share: FixedShare | None
) -> Callable[..., Any]:
    """Radiance of faces under each light as a function of `ShadedFaces.variables`."""
    strengths = (lights.strength @ LUMINANCE)[:, None] if mi.is_monochromatic else lights.strength
    full = [mi.Float(np.repeat(s, faces.faces).astype(np.float32)) for s in strengths.T]

    def radiance(p: Any, q: Any, rise: Any) -> Any:
        si, frame, points = faces.at(p, q, rise)
        toward, arriving = lights.arriving(points, faces.faces)
        local = frame.to_local(toward)
        value = bsdf.eval(mi.BSDFContext(), si, local)
        if share is not None:
            arriving = arriving * share(si, local, points, toward)
        irradiance = [strength * arriving for strength in full]
        return (
            value[0] * irradiance[0] if mi.is_monochromatic else mi.luminance(value * mi.Color3f(irradiance))
        )

    return radiance


def _tiled(vectors: Array, count: int) -> list[Any]:
    """Components of vectors (faces, n), so many times one after the other; of one vector if all are alike."""
    alike = not np.ptp(vectors, axis=0).any()
    chosen = vectors[:1] if alike else np.tile(vectors, (count, 1))
    return [mi.Float(np.ascontiguousarray(component)) for component in chosen.T.astype(np.float32)]
