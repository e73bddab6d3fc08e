"""Pair radiance: what each face adds to each pixel under lights that shine together, and its derivatives.

A face of one material has one radiance for each light, so that its lit share in the pixel suffices. Where
textures vary the material, every sample is shaded at its own place. Seen from the side this place slides over
the plate as the face rises: with d the direction of the ray and n the unnormalised normal (-z_x, -z_y, 1) of
the face, a rise dz moves the point by d dz / (n . d).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index
from visual.exact.face_shading import Shading, ShadingPoints, shade, unshadowed
from visual.geometry.film_samples import PictureSamples
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection
from visual.lights.near import LightSet, NearLights


class PairRadiance(NamedTuple):
    """Radiance that (pixel, face) pairs add to their pixels, and its derivatives by the plane of the face.

    Attributes:
        radiance, by_slope_x, by_slope_y: (pairs,).
        by_height: (pairs,) at the face's first vertex, 1/mm; None if the radiance depends on slopes alone.
    """

    radiance: Array
    by_slope_x: Array
    by_slope_y: Array
    by_height: Array | None = None


def face_shading(bsdf: Any, camera: Projection, lights: LightSet, mesh: PlacedMesh) -> Shading:
    """Shading of the faces of a plate without textures; near lights shine on a face as on its centre."""
    view, places = camera.toward(mesh.centres), ShadingPoints(mesh.centres)
    if isinstance(lights, NearLights):
        slide = mesh.slide(np.arange(len(view)), view)
        places = ShadingPoints(mesh.centres, slide=slide)
    return shade(bsdf, *mesh.slopes, lights, view, places)


def of_faces(
    shading: Shading, lights: LightSet, samples: PictureSamples, points: Array, mesh: PlacedMesh
) -> PairRadiance:
    """Pair radiance of faces that have one radiance each.

    Args:
        shading: of the faces under these lights.
        lights: shine together.
        samples: of the picture.
        points: (samples, 3) mm, from which shadow rays start.
        mesh: the plate.
    """
    shares = np.empty((len(lights), len(samples.pair_pixel)))
    for number in range(len(lights)):
        lit = np.flatnonzero(lit_by(mesh, lights, number, samples.face, points))
        shares[number] = np.bincount(samples.pair[lit], minlength=len(samples.pair_pixel))
    shares /= samples.per_pixel
    every = [shading.radiance, shading.by_slope_x, shading.by_slope_y]
    if shading.by_rise is not None:
        every.append(shading.by_rise)
    pairs = [np.einsum("lp,lp->p", shares, values[:, samples.pair_face]) for values in every]
    if shading.by_rise is not None:
        _at_first_vertex(pairs, mesh, samples.pair_face, mesh.centres[samples.pair_face])
    return PairRadiance(*pairs)


def lit_by(mesh: PlacedMesh, lights: LightSet, number: int, face: Index, points: Array) -> NDArray[np.bool_]:
    """Whether points (points, 3) on faces see one of some lights."""
    distance = lights.distance(number, points) if isinstance(lights, NearLights) else np.inf
    return mesh.sees(lights.toward_from(number, points), face, points, distance)


def _at_first_vertex(values: list[Array], mesh: PlacedMesh, face: Index, points: Array) -> None:
    """Turn derivatives by slopes and by the rise at points into those by slopes and the first vertex."""
    offset = points - mesh.vertices[mesh.plate.faces[face, 0]]
    values[1] += values[3] * offset[:, 0]
    values[2] += values[3] * offset[:, 1]


def of_samples(
    bsdf: Any,
    camera: Projection,
    lights: LightSet,
    samples: PictureSamples,
    points: Array,
    mesh: PlacedMesh,
) -> PairRadiance:
    """Pair radiance of a textured plate, sample by sample.

    Args:
        bsdf: material of the plate.
        camera: takes the picture.
        lights: shine together.
        samples: of the picture.
        points: (samples, 3) mm, from which shadow rays start.
        mesh: the plate.
    """
    sums = np.zeros((4, len(samples.pair_pixel)))
    sliding = isinstance(lights, NearLights) or not camera.overhead
    for number in range(len(lights)):
        lit = np.flatnonzero(lit_by(mesh, lights, number, samples.face, points))
        if len(lit) == 0:
            continue
        at, face = points[lit], samples.face[lit]
        slope_x, slope_y = (slope[face] for slope in mesh.slopes)
        view = camera.toward(at)
        places = places_of(mesh, at, mesh.slide(face, view) if sliding else None)
        shading = shade(bsdf, slope_x, slope_y, lights.single(number), view, places)
        values = [shading.radiance[0], shading.by_slope_x[0], shading.by_slope_y[0]]
        if shading.by_rise is not None:
            values.append(shading.by_rise[0])
            _at_first_vertex(values, mesh, face, at)
        for total, value in zip(sums, values, strict=False):
            total += np.bincount(samples.pair[lit], value, minlength=len(total))
    return PairRadiance(*sums / samples.per_pixel)


def places_of(mesh: PlacedMesh, points: Array, slide: Array | None = None) -> ShadingPoints:
    """Places of points (points, 3) on the plate, which slide (points, 3) mm per mm."""
    if not mesh.textured:
        return ShadingPoints(points, slide=slide)
    size_mm = mesh.plate.size_mm, mesh.plate.height_mm
    return ShadingPoints(points, mesh.uv(points), slide, None if slide is None else slide[:, :2] / size_mm)


def at_points(
    bsdf: Any,
    camera: Projection,
    lights: LightSet,
    mesh: PlacedMesh,
    light: Index,
    face: Index,
    points: Array,
) -> Array:
    """Unshadowed radiance (points,) of a plate toward the camera, point by point.

    Args:
        bsdf: material of the plate.
        camera: takes the picture.
        lights: of which one shines on each point.
        mesh: the plate.
        light, face: (points,) number of the light that shines on each point, and of the point's face.
        points: (points, 3) mm.
    """
    radiance = np.zeros(len(points))
    for number in np.unique(light):
        lit = np.flatnonzero(light == number)
        slope_x, slope_y = (slope[face[lit]] for slope in mesh.slopes)
        view, places = camera.toward(points[lit]), places_of(mesh, points[lit])
        radiance[lit] = unshadowed(bsdf, slope_x, slope_y, lights.single(number), view, places)[0]
    return radiance
