"""Views: pictures of the plate by one camera and their Jacobians by the heights, as sparse matrices.

A picture is, pixel by pixel, the lit share of each face times the face's radiance
(`visual.exact.pair_radiance`). The derivative has three parts: radiance by slope (each face's radiance
depends on its three heights), the motion of shadow boundaries
(`visual.exact.shadow_edges`), and, unless the camera looks straight down, the motion of faces in the picture
(`visual.exact.visibility_edges`). Film positions are fixed, so that two reliefs differ by geometry alone, not
by noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array
from relief.ground.progress import stage
from visual.backend.user_settings import user_settings_kept
from visual.exact.discontinuities import EdgeSamples, discontinuity_entries, edge_jitter
from visual.exact.fixed_samples import FixedSamples
from visual.exact.light_scene import Illumination, LightScene
from visual.exact.lobes import Lobes
from visual.exact.pair_radiance import LitPlate
from visual.exact.shadow_edges import Entries, shadow_edges
from visual.exact.visibility_edges import VisibilityEdges, visibility_edges
from visual.geometry.film_samples import PictureSamples, film_points, samples_by_rays, samples_from_above
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.projection import Projection


@dataclass(frozen=True)
class Pictures:
    """Pictures and their Jacobians.

    Attributes:
        pictures: (conditions, rows, cols) radiance.
        jacobians: for each condition (pixels, heights) d radiance / d mm; empty if none were wanted.
    """

    pictures: Array
    jacobians: tuple[sp.csr_matrix, ...]


class _ViewSamples(NamedTuple):
    """Samples of a picture and of its edges, under one light or under lights of many directions.

    Attributes:
        samples: of the picture.
        points: (samples, 3) mm, from which their shadow rays start.
        edges: primary-visibility edges; None if none are wanted.
    """

    samples: PictureSamples
    points: Array
    edges: VisibilityEdges | None


class View:
    """A plate before one camera, lit by one light (or several together) at a time and ambient light.

    Attributes:
        overhead: whether the camera looks straight down on a plate that fills the picture.
    """

    def __init__(
        self,
        loaded: LightScene,
        camera: Projection,
        alone: Sequence[Illumination],
        ambient: Illumination | None,
        samples: FixedSamples,
        lobes: Lobes | None = None,
    ) -> None:
        """Fix the samples.

        Args:
            loaded: holds the plate, for rays and its material only.
            camera: takes the pictures.
            alone: one condition each; with none, ambient light alone is the one condition.
            ambient: added to every condition; None if there is none.
            samples: of the pictures. Where the film's filter is no box, its `strata` serve all lights.
            lobes: of the material, for lights that rays can meet.
        """
        generator, strata = np.random.default_rng(samples.seed), samples.strata
        self._loaded, self._bsdf, self._lobes = loaded, loaded.bsdf, lobes
        self._plate = loaded.plate
        self._shape, reconstruction = (camera.rows, camera.cols), camera.filter
        self._alone, self._ambient = alone, ambient
        # Many directions share a pixel's samples: each needs fewer.
        self._strata = strata, samples.ambient_strata or max(1, strata // 2)
        if reconstruction is not None:
            # A pixel of the finer camera is one sample, whose weights in the picture follow from its place.
            camera, self._strata = camera.finer(strata), (1, 1)
        self._camera, self.overhead = camera, camera.overhead
        self._film = [film_points(camera, count, generator) for count in self._strata]
        self._weights: sp.csr_matrix | None = None
        if reconstruction is not None:
            self._film = self._film[:1] * 2
            self._weights = reconstruction.of_points(self._film[0] / strata, *self._shape)
        self._jitter = edge_jitter(self._plate, generator, samples.edge_samples or EdgeSamples())
        self._from_above: list[PictureSamples] = []
        if camera.overhead:
            self._from_above = [
                samples_from_above(self._plate, camera, film, count**2)
                for film, count in zip(self._film, self._strata, strict=True)
            ]

    @user_settings_kept
    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        """Pictures of a relief, and their Jacobians.

        Args:
            heights: (rows, cols) mm.
            jacobian: whether derivatives are wanted.
            edges: whether the derivatives include the motion of shadow boundaries and of faces.
        """
        self._loaded.set_heights(heights)
        mesh = PlacedMesh(self._loaded.scene, self._plate, heights)
        shining = (*self._alone, *(() if self._ambient is None else (self._ambient,)))
        many = [len(light.lights) > 1 for light in shining]
        samples = {which: self._samples(mesh, which, jacobian and edges) for which in set(many)}
        conditions = []
        with stage("pictures of a step", len(shining)) as advance:
            for light, which in zip(shining, many, strict=True):
                conditions.append(self._lit_by(light, samples[which], mesh, jacobian, edges))
                advance()
        if self._ambient is not None:
            picture, entries = conditions.pop()
            conditions = [(p + picture, d + entries if jacobian else None) for p, d in conditions] or [
                (picture, entries)
            ]
        pictures = np.stack([p.reshape(self._shape) for p, _ in conditions])
        return Pictures(pictures, tuple(d for _, d in conditions) if jacobian else ())

    def _samples(self, mesh: PlacedMesh, many: bool, edges: bool) -> _ViewSamples:
        if self._from_above:
            samples = self._from_above[many]
        else:
            samples = samples_by_rays(mesh, self._camera, self._film[many], self._strata[many] ** 2)
        positions = self._jitter.of_visibility(many)
        visible = visibility_edges(mesh, self._camera, positions) if edges else None
        return _ViewSamples(samples, mesh.lifted(samples.face, samples.x, samples.y), visible)

    def _lit_by(
        self, light: Illumination, of_view: _ViewSamples, mesh: PlacedMesh, jacobian: bool, edges: bool
    ) -> tuple[Array, Any]:
        """Picture (pixels,) and Jacobian (pixels, heights) under a set of lights that shine together."""
        plate, camera, (samples, points, visible) = self._plate, self._camera, of_view
        lit = LitPlate(mesh, camera, self._bsdf, light, self._lobes, jacobian)
        radiance, by_slope_x, by_slope_y, *by_height = lit.pairs(samples, points)
        behind = light.background(samples.missed_direction) / samples.per_pixel
        picture: Array = np.zeros(camera.pixels)
        picture += np.bincount(samples.pair_pixel, radiance, minlength=camera.pixels)
        picture += np.bincount(samples.missed_pixel, behind, minlength=camera.pixels)
        if self._weights is not None:
            picture = self._weights @ picture
        if not jacobian:
            return picture, None
        face = samples.pair_face
        values = by_slope_x[:, None] * plate.slope_x[face]
        values += by_slope_y[:, None] * plate.slope_y[face]
        for change in by_height:
            values[:, 0] += change
        columns = plate.sample[plate.faces[face]].ravel()
        parts: list[Entries] = [(np.repeat(samples.pair_pixel, 3), columns, values.ravel())]
        if edges:
            positions = self._jitter.of_shadows(light.lights)
            shadows = shadow_edges(mesh, light.lights, positions, camera.overhead)
            parts += discontinuity_entries(lit, shadows, visible)
        r, c, v = (np.concatenate(p) for p in zip(*parts, strict=True))
        by_heights = sp.csr_matrix((v, (r, c)), shape=(camera.pixels, plate.rows * plate.cols))
        return picture, by_heights if self._weights is None else self._weights @ by_heights
