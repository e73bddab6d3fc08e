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
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index
from visual.exact.face_shading import FixedShare, Shading, ShadingPoints, shade
from visual.exact.light_scene import Illumination
from visual.exact.lobes import Lobes, Reflections
from visual.geometry.film_samples import PictureSamples
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection
from visual.lights.near import LightSet, NearLights

SAMPLES_AT_ONCE = 2**17
"""Most samples of a textured plate whose reflections are computed at once, which take some 0.3 GB."""


@dataclass(frozen=True)
class LitPlate:
    """The plate at some heights before a camera, under lights that shine together.

    Attributes:
        mesh: the plate.
        camera: takes the picture.
        bsdf: the plate's material.
        light: the lights.
        lobes: parts of the material that are sampled; None if there are none.
        derivatives: whether those of `shading` and `pairs` are wanted; they are 0 if not.
    """

    mesh: PlacedMesh
    camera: Projection
    bsdf: Any
    light: Illumination
    lobes: Lobes | None
    derivatives: bool

    @property
    def lights(self) -> LightSet:
        """The parallel or near lights."""
        return self.light.lights

    @property
    def near(self) -> bool:
        """Whether the lights are near, so that they differ from place to place."""
        return isinstance(self.lights, NearLights)

    @cached_property
    def share(self) -> FixedShare | None:
        """Share of the radiance under fixed lights that counts; None: all."""
        seen = self.light.seen
        return None if self.lobes is None or seen is None else self.lobes.fixed_share(seen)

    @cached_property
    def shading(self) -> Shading | None:
        """Shading of the faces, on which near lights shine as on their centres; None of a textured plate."""
        if self.mesh.textured:
            return None
        every = np.arange(len(self.mesh.centres))
        return self.shade(self.lights, every, *self._centres, self.derivatives)

    @cached_property
    def _centres(self) -> tuple[Array, ShadingPoints]:
        """Directions (faces, 3) from the centres of the faces to the camera, and these centres."""
        view = self.camera.toward(self.mesh.centres)
        slide = self.mesh.slide(np.arange(len(view)), view) if self.near else None
        return view, ShadingPoints(self.mesh.centres, slide=slide)

    def shade(
        self, lights: LightSet, face: Index, view: Array, places: ShadingPoints, derivatives: bool = False
    ) -> Shading:
        """Shading of points (points,) on faces along `view` (points, 3) to the camera, by some lights."""
        slope_x, slope_y = (slope[face] for slope in self.mesh.slopes)
        return shade(self.bsdf, slope_x, slope_y, lights, view, places, self.share, derivatives)

    def reflections(
        self, face: Index, view: Array, places: ShadingPoints, derivatives: bool = False
    ) -> Reflections | None:
        """What points (points,) on faces show by sampled directions; None if none are sampled."""
        if self.lobes is None or self.light.seen is None or len(face) == 0:
            return None
        slope_x, slope_y = (slope[face] for slope in self.mesh.slopes)
        seen = self.light.seen
        return self.lobes.reflections(slope_x, slope_y, face, seen, view, places, derivatives)

    def lit_by(self, number: int, face: Index, points: Array) -> NDArray[np.bool_]:
        """Whether points (points, 3) on faces see one of the lights."""
        distance = self.lights.distance(number, points) if self.near else np.inf
        return self.mesh.sees(self.lights.toward_from(number, points), face, points, distance)

    def places(self, points: Array, slide: Array | None = None) -> ShadingPoints:
        """Places of points (points, 3) on the plate, which slide (points, 3) mm per mm."""
        mesh = self.mesh
        if not mesh.textured:
            return ShadingPoints(points, slide=slide)
        size_mm = mesh.plate.size_mm, mesh.plate.height_mm
        return ShadingPoints(
            points, mesh.uv(points), slide, None if slide is None else slide[:, :2] / size_mm
        )

    def at_points(self, light: Index, face: Index, points: Array) -> Array:
        """Unshadowed radiance (points,) toward the camera, point by point.

        Args:
            light, face: (points,) number of the light that shines on each point, and of the point's face.
            points: (points, 3) mm.
        """
        radiance = np.zeros(len(points))
        for number in np.unique(light):
            lit = np.flatnonzero(light == number)
            view, places = self.camera.toward(points[lit]), self.places(points[lit])
            radiance[lit] = self.shade(self.lights.single(number), face[lit], view, places).radiance[0]
        return radiance

    def pairs(self, samples: PictureSamples, points: Array) -> Array:
        """What (pixel, face) pairs add to their pixels.

        Args:
            samples: of the picture.
            points: (samples, 3) mm, from which shadow rays start.

        Returns:
            (3 or 4, pairs): radiance, its derivatives by the face's slopes, and, unless it depends on slopes
            alone, by the height of the face's first vertex, 1/mm.
        """
        if self.shading is None:
            return self._of_samples(samples, points)
        return self._of_faces(self.shading, samples, points)

    def _of_faces(self, shading: Shading, samples: PictureSamples, points: Array) -> Array:
        """`pairs` of faces that have one radiance each."""
        mesh, face = self.mesh, samples.face
        lit = (self.lit_by(number, face, points) for number in range(len(self.lights)))
        sums = _face_sums(shading, lit, samples)
        reflections = self.reflections(np.arange(len(mesh.centres)), *self._centres, self.derivatives)
        if reflections is not None:
            sums += _face_sums(reflections.shading, reflections.lit(mesh, face, points, face), samples)
        if shading.by_rise is not None:
            _at_first_vertex(sums, mesh, samples.pair_face, mesh.centres[samples.pair_face])
        return sums

    def _of_samples(self, samples: PictureSamples, points: Array) -> Array:
        """`pairs` of a textured plate, sample by sample."""
        mesh, face = self.mesh, samples.face
        sums = np.zeros((4, len(samples.pair_pixel)))
        sliding = self.near or not self.camera.overhead

        def placed(which: Index) -> tuple[Array, ShadingPoints]:
            """Directions of samples to the camera, and their places."""
            at, view = points[which], self.camera.toward(points[which])
            return view, self.places(at, mesh.slide(face[which], view) if sliding else None)

        def add(which: Index, values: list[Array]) -> None:
            """Add radiance and derivatives (samples,) of some samples to their pairs."""
            if sliding:
                _at_first_vertex(values, mesh, face[which], points[which])
            for total, value in zip(sums, values, strict=False):
                total += np.bincount(samples.pair[which], value, minlength=len(total))

        for number in range(len(self.lights)):
            lit = np.flatnonzero(self.lit_by(number, face, points))
            if len(lit):
                one = self.lights.single(number)
                shading = self.shade(one, face[lit], *placed(lit), self.derivatives)
                add(lit, [values[0] for values in shading.values])
        for first in range(0, len(points), SAMPLES_AT_ONCE):
            part = np.arange(first, min(first + SAMPLES_AT_ONCE, len(points)))
            reflections = self.reflections(face[part], *placed(part), self.derivatives)
            if reflections is None:
                break
            every = reflections.lit(mesh, face[part], points[part], part - first)
            for number, seeing in enumerate(every):
                lit = np.flatnonzero(seeing)
                add(part[lit], [values[number, lit] for values in reflections.shading.values])
        return np.asarray(sums / samples.per_pixel)


def _face_sums(shading: Shading, lit: Iterable[NDArray[np.bool_]], samples: PictureSamples) -> Array:
    """Radiance and derivatives (3 or 4, pairs) of lit shares; `lit` is of each light, over the samples."""
    pairs = (samples.pair[np.flatnonzero(seeing)] for seeing in lit)
    counts = [np.bincount(lit_pairs, minlength=len(samples.pair_pixel)) for lit_pairs in pairs]
    shares = np.stack(counts) / samples.per_pixel
    return np.stack(
        [np.einsum("lp,lp->p", shares, values[:, samples.pair_face]) for values in shading.values]
    )


def _at_first_vertex(values: list[Array] | Array, mesh: PlacedMesh, face: Index, points: Array) -> None:
    """Turn derivatives by slopes and by the rise at points into those by slopes and the first vertex."""
    offset = points - mesh.vertices[mesh.plate.faces[face, 0]]
    values[1] += values[3] * offset[:, 0]
    values[2] += values[3] * offset[:, 1]
