"""Pair radiance: what each face adds to each pixel under lights that shine together, and its derivatives.

A face of one material has one radiance for each light, so that its lit share in the pixel suffices. Where
textures vary the material, every sample is shaded at its own place. Seen from the side this place slides over
the plate as the face rises: with d the direction of the ray and n the unnormalised normal (-z_x, -z_y, 1) of
the face, a rise dz moves the point by d dz / (n . d).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from relief.common.arrays import Array, Index
from visual.exact.shading import Shading, shade, unshadowed
from visual.geometry.film_samples import PictureSamples
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection
from visual.lights.parallel import ParallelLights


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


def of_faces(
    shading: Shading, lights: ParallelLights, samples: PictureSamples, mesh: PlacedMesh
) -> PairRadiance:
    """Pair radiance of faces that have one radiance each.

    Args:
        shading: of the faces under these lights.
        lights: parallel lights.
        samples: of the picture.
        mesh: the plate.
    """
    shares = np.empty((len(lights), len(samples.pair_pixel)))
    points = mesh.lifted(samples.face, samples.x, samples.y)
    for number, toward in enumerate(lights.toward):
        lit = np.flatnonzero(mesh.sees(toward, samples.face, points))
        shares[number] = np.bincount(samples.pair[lit], minlength=len(samples.pair_pixel))
    shares /= samples.per_pixel
    every = (shading.radiance, shading.by_slope_x, shading.by_slope_y)
    return PairRadiance(*(np.einsum("lp,lp->p", shares, values[:, samples.pair_face]) for values in every))


def of_samples(
    bsdf: Any, camera: Projection, lights: ParallelLights, samples: PictureSamples, mesh: PlacedMesh
) -> PairRadiance:
    """Pair radiance of a textured plate, sample by sample.

    Args:
        bsdf: material of the plate.
        camera: takes the picture.
        lights: parallel lights.
        samples: of the picture.
        mesh: the plate.
    """
    sums = np.zeros((4, len(samples.pair_pixel)))
    points = mesh.lifted(samples.face, samples.x, samples.y)
    for number, toward in enumerate(lights.toward):
        lit = np.flatnonzero(mesh.sees(toward, samples.face, points))
        if len(lit) == 0:
            continue
        at, face = points[lit], samples.face[lit]
        slope_x, slope_y = (slope[face] for slope in mesh.slopes)
        view = camera.toward(at)
        shading = shade(bsdf, slope_x, slope_y, lights.single(number), view, mesh.uv(at), not camera.overhead)
        values = [shading.radiance[0], shading.by_slope_x[0], shading.by_slope_y[0]]
        if shading.by_u is not None and shading.by_v is not None:
            x, y, z = view.T
            along = shading.by_u[0] * x / mesh.plate.size_mm + shading.by_v[0] * y / mesh.plate.height_mm
            by_height = along / (z - slope_x * x - slope_y * y)
            first = mesh.vertices[mesh.plate.faces[face, 0]]
            values[1] += by_height * (at - first)[:, 0]
            values[2] += by_height * (at - first)[:, 1]
            values.append(by_height)
        for total, value in zip(sums, values, strict=False):
            total += np.bincount(samples.pair[lit], value, minlength=len(total))
    return PairRadiance(*sums / samples.per_pixel)


def at_points(
    bsdf: Any,
    camera: Projection,
    lights: ParallelLights,
    mesh: PlacedMesh,
    light: Index,
    face: Index,
    points: Array,
) -> Array:
    """Unshadowed radiance (points,) of a textured plate toward the camera.

    Args:
        bsdf: material of the plate.
        camera: takes the picture.
        lights: parallel lights.
        mesh: the plate.
        light, face: (points,) number of the light that shines on each point, and of the point's face.
        points: (points, 3) mm.
    """
    radiance = np.zeros(len(points))
    for number in np.unique(light):
        of = np.flatnonzero(light == number)
        slope_x, slope_y = (slope[face[of]] for slope in mesh.slopes)
        view, uv = camera.toward(points[of]), mesh.uv(points[of])
        radiance[of] = unshadowed(bsdf, slope_x, slope_y, lights.single(number), view, uv)[0]
    return radiance
