"""Pair radiance: what each face adds to each pixel under lights that shine together, and its derivatives.

A face of one material has one radiance for each light, so that its lit share in the pixel suffices. Where
textures vary the material, every sample is shaded at its own place. Seen from the side this place slides over
the plate as the face rises: with d the direction of the ray and n the unnormalised normal (-z_x, -z_y, 1) of
the face, a rise dz moves the point by d dz / (n . d).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index
from visual.exact.face_shading import FixedShare, Shading, ShadingPoints, shade, unshadowed
from visual.exact.lobes import Lobes, Reflections
from visual.geometry.film_samples import PictureSamples
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection
from visual.lights.near import LightSet, NearLights
from visual.lights.seen import SeenLight

SAMPLES_AT_ONCE = 2**17
"""Most samples of a textured plate whose reflections are computed at once, which take some 0.3 GB."""


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


@dataclass(frozen=True)
class Material:
    """The plate's material under lights that shine together.

    Attributes:
        bsdf: of Mitsuba.
        lobes: its parts that are sampled; None if there are none.
        seen: the light as rays see it; None if rays cannot meet the light.
    """

    bsdf: Any
    lobes: Lobes | None = None
    seen: SeenLight | None = None

    @cached_property
    def share(self) -> FixedShare | None:
        """Share of the radiance under fixed lights; None: all."""
        return None if self.lobes is None or self.seen is None else self.lobes.fixed_share(self.seen)

    def reflections(
        self, mesh: PlacedMesh, face: Index, view: Array, places: ShadingPoints, derivatives: bool
    ) -> Reflections | None:
        """What points (points,) on faces show by sampled directions; None if none are sampled."""
        if self.lobes is None or self.seen is None or len(face) == 0:
            return None
        slope_x, slope_y = (slope[face] for slope in mesh.slopes)
        return self.lobes.reflections(slope_x, slope_y, face, self.seen, view, places, derivatives)


def face_shading(
    material: Material, camera: Projection, lights: LightSet, mesh: PlacedMesh, derivatives: bool
) -> Shading:
    """Shading of the faces of a plate without textures; near lights shine on a face as on its centre."""
    view, places = _centres(camera, lights, mesh)
    return shade(material.bsdf, *mesh.slopes, lights, view, places, material.share, derivatives)


def _centres(camera: Projection, lights: LightSet, mesh: PlacedMesh) -> tuple[Array, ShadingPoints]:
    """Directions (faces, 3) from the centres of the faces to the camera, and these centres."""
    view = camera.toward(mesh.centres)
    slide = mesh.slide(np.arange(len(view)), view) if isinstance(lights, NearLights) else None
    return view, ShadingPoints(mesh.centres, slide=slide)


def of_faces(
    material: Material,
    camera: Projection,
    shading: Shading,
    lights: LightSet,
    samples: PictureSamples,
    points: Array,
    mesh: PlacedMesh,
    derivatives: bool,
) -> PairRadiance:
    """Pair radiance of faces that have one radiance each.

    Args:
        material: of the plate.
        camera: takes the picture.
        shading: of the faces under these lights.
        lights: shine together.
        samples: of the picture.
        points: (samples, 3) mm, from which shadow rays start.
        mesh: the plate.
        derivatives: whether they are wanted; they are 0 if not.
    """
    face = samples.face
    lit = (lit_by(mesh, lights, number, face, points) for number in range(len(lights)))
    sums = _face_sums(shading, lit, samples)
    every = np.arange(len(mesh.centres))
    reflections = material.reflections(mesh, every, *_centres(camera, lights, mesh), derivatives)
    if reflections is not None:
        sums += _face_sums(reflections.shading, reflections.lit(mesh, face, points, face), samples)
    if shading.by_rise is not None:
        _at_first_vertex(sums, mesh, samples.pair_face, mesh.centres[samples.pair_face])
    return PairRadiance(*sums)


def _face_sums(shading: Shading, lit: Iterable[NDArray[np.bool_]], samples: PictureSamples) -> Array:
    """Radiance and derivatives (3 or 4, pairs) of lit shares; `lit` is of each light, over the samples."""
    pairs = (samples.pair[np.flatnonzero(seeing)] for seeing in lit)
    counts = [np.bincount(lit_pairs, minlength=len(samples.pair_pixel)) for lit_pairs in pairs]
    shares = np.stack(counts) / samples.per_pixel
    return np.stack(
        [np.einsum("lp,lp->p", shares, values[:, samples.pair_face]) for values in shading.values]
    )


def of_samples(
    material: Material,
    camera: Projection,
    lights: LightSet,
    samples: PictureSamples,
    points: Array,
    mesh: PlacedMesh,
    derivatives: bool,
) -> PairRadiance:
    """Pair radiance of a textured plate, sample by sample; arguments as of `of_faces`."""
    sums = np.zeros((4, len(samples.pair_pixel)))
    sliding = isinstance(lights, NearLights) or not camera.overhead

    def placed(which: Index) -> tuple[Array, ShadingPoints]:
        """Directions of samples to the camera, and their places."""
        at, view = points[which], camera.toward(points[which])
        return view, places_of(mesh, at, mesh.slide(samples.face[which], view) if sliding else None)

    def add(which: Index, values: list[Array]) -> None:
        """Add radiance and derivatives (samples,) of some samples to their pairs."""
        if sliding:
            _at_first_vertex(values, mesh, samples.face[which], points[which])
        for total, value in zip(sums, values, strict=False):
            total += np.bincount(samples.pair[which], value, minlength=len(total))

    for number in range(len(lights)):
        lit = np.flatnonzero(lit_by(mesh, lights, number, samples.face, points))
        if len(lit):
            slope_x, slope_y = (slope[samples.face[lit]] for slope in mesh.slopes)
            one, (view, places) = lights.single(number), placed(lit)
            share = material.share
            shading = shade(material.bsdf, slope_x, slope_y, one, view, places, share, derivatives)
            add(lit, [values[0] for values in shading.values])
    for first in range(0, len(points), SAMPLES_AT_ONCE):
        part = np.arange(first, min(first + SAMPLES_AT_ONCE, len(points)))
        reflections = material.reflections(mesh, samples.face[part], *placed(part), derivatives)
        if reflections is None:
            break
        every = reflections.lit(mesh, samples.face[part], points[part], part - first)
        for number, seeing in enumerate(every):
            lit = np.flatnonzero(seeing)
            add(part[lit], [values[number, lit] for values in reflections.shading.values])
    return PairRadiance(*sums / samples.per_pixel)


def lit_by(mesh: PlacedMesh, lights: LightSet, number: int, face: Index, points: Array) -> NDArray[np.bool_]:
    """Whether points (points, 3) on faces see one of some lights."""
    distance = lights.distance(number, points) if isinstance(lights, NearLights) else np.inf
    return mesh.sees(lights.toward_from(number, points), face, points, distance)


def _at_first_vertex(values: list[Array] | Array, mesh: PlacedMesh, face: Index, points: Array) -> None:
    """Turn derivatives by slopes and by the rise at points into those by slopes and the first vertex."""
    offset = points - mesh.vertices[mesh.plate.faces[face, 0]]
    values[1] += values[3] * offset[:, 0]
    values[2] += values[3] * offset[:, 1]


def places_of(mesh: PlacedMesh, points: Array, slide: Array | None = None) -> ShadingPoints:
    """Places of points (points, 3) on the plate, which slide (points, 3) mm per mm."""
    if not mesh.textured:
        return ShadingPoints(points, slide=slide)
    size_mm = mesh.plate.size_mm, mesh.plate.height_mm
    return ShadingPoints(points, mesh.uv(points), slide, None if slide is None else slide[:, :2] / size_mm)


def at_points(
    material: Material,
    camera: Projection,
    lights: LightSet,
    mesh: PlacedMesh,
    light: Index,
    face: Index,
    points: Array,
) -> Array:
    """Unshadowed radiance (points,) of a plate toward the camera, point by point.

    Args:
        material: of the plate.
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
        one = lights.single(number)
        radiance[lit] = unshadowed(material.bsdf, slope_x, slope_y, one, view, places, material.share)[0]
    return radiance
