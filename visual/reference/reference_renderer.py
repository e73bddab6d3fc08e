"""Reference renderer: many reliefs under many lights from straight above, to learn from and to judge by.

The camera sees the same parts of faces in each pixel whatever the heights, and a face's radiance has a closed
form (`visual.exact.face_shading`, by Mitsuba's own material). What remains is the lit share of each part. For
a parallel light Mitsuba's shadow rays find the share: most of the plate lies wholly in light or in shadow,
and only where a few rays disagree are many traced. For ambient light the horizons are found exactly
(`visual.reference.horizon`) and the light above them integrated (`visual.reference.ambient_radiance`).
"""

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from visual.backend.plate_shape import is_textured
from visual.backend.user_settings import keeping_user_settings
from visual.exact.face_shading import unshadowed
from visual.geometry.film_samples import film_points, samples_from_above
from visual.geometry.placed_mesh import PlacedMesh
from visual.lights.parallel import ParallelLights
from visual.reference.ambient_radiance import ambient_radiance
from visual.reference.face_parts import pixel_shares, points_by_part
from visual.scene import Scene

STRATA = 12
"""Shadow rays along a pixel's side where light and shadow meet."""
FEWEST_STRATA = 6
"""Least number of strata: every part of a face in a pixel has a ray."""
COARSE_RAYS = 2
"""Shadow rays from each part that find where light and shadow meet; 8 make no picture better."""
AZIMUTHS = 8
"""Azimuths of horizons from one point of each part, drawn anew for each point."""


@keeping_user_settings
class ReferenceRenderer:
    """The plate of a scene before a camera straight above, with a pixel at each height sample."""

    def __init__(self, scene: Scene, strata: int = STRATA, seed: int = 0) -> None:
        """Fix the points at which light is computed.

        Args:
            scene: whose material and camera these are; its first light scene is used for rays.
            strata: shadow rays along a pixel's side where light and shadow meet, at least 6.
            seed: of the points.

        Raises:
            ValueError: the camera is not straight above or has no pixel at each sample, the plate
                is textured, repeats or is not square, or too few strata.
        """
        if strata < FEWEST_STRATA:
            raise ValueError(f"at least {FEWEST_STRATA} strata are needed")
        loaded = scene.light_scenes()[0]
        self._loaded, self._camera = loaded, loaded.cameras[0]
        rows, cols = scene.heights.shape
        if not self._camera.overhead or scene.resolution != (rows, cols):
            raise ValueError("the camera must look straight down, with one pixel at each height sample")
        if any(scene.plate.halo) or rows != cols:
            raise ValueError("the plate must be square and end at its sides")
        if is_textured(loaded.scene):
            raise ValueError("the material must be the same all over the plate")
        self._bsdf = loaded.bsdf
        self._plate = scene.plate
        generator = np.random.default_rng(seed)
        film = film_points(self._camera, strata, generator)
        samples = samples_from_above(self._plate, self._camera, film, strata**2)
        self._fine = points_by_part(samples, generator)
        self._coarse = self._fine.thinned(COARSE_RAYS)
        self._single = self._fine.thinned(1)
        self._share = pixel_shares(self._plate, self._fine.samples)

    def parallel_pictures(self, heights: Array, toward: Array) -> Array:
        """Pictures under each of some parallel lights alone, of irradiance pi on a plane that faces it.

        Args:
            heights: (rows, cols) mm.
            toward: (lights, 3) unit vectors toward the lights.

        Returns:
            (lights, rows, cols) radiance.
        """
        lights = ParallelLights(toward, np.full(len(toward), np.pi))
        mesh = self._place(heights)
        radiance = unshadowed(self._bsdf, *mesh.slopes, lights, self._camera.toward(mesh.centres))[
            :, self._coarse.samples.pair_face
        ]
        coarse = self._coarse.samples
        starts = mesh.lifted(coarse.face, coarse.x, coarse.y)
        pictures = []
        for direction, full in zip(toward, radiance, strict=True):
            lit = self._lit_share(mesh, direction, starts)
            pictures.append(self._picture(full * lit))
        return np.stack(pictures)

    def ambient_picture(self, heights: Array, seed: int, azimuths: int = AZIMUTHS) -> Array:
        """The picture under ambient light of radiance 1.

        Args:
            heights: (rows, cols) mm.
            seed: of the azimuths, which are unbiased.
            azimuths: of each point.

        Returns:
            (rows, cols) radiance.
        """
        mesh, generator = self._place(heights), np.random.default_rng(seed)
        return self._picture(ambient_radiance(self._bsdf, mesh, self._single.samples, azimuths, generator))

    def _place(self, heights: Array) -> PlacedMesh:
        self._loaded.set_heights(heights)
        return PlacedMesh(self._loaded.scene, self._plate, heights)

    def _picture(self, radiance: Array) -> Array:
        """Picture (rows, cols) of the radiance (parts,) of each part of a face in a pixel."""
        samples, camera = self._fine.samples, self._camera
        picture: Array = np.zeros(camera.pixels)
        picture += np.bincount(samples.pair_pixel, radiance * self._share, minlength=camera.pixels)
        return picture.reshape(camera.rows, camera.cols)

    def _lit_share(self, mesh: PlacedMesh, toward: Array, starts: Array) -> Array:
        """Share (parts,) of each part that sees a light; `starts` are the coarse points, lifted."""
        coarse = self._coarse
        seen = mesh.sees(toward, coarse.samples.face, starts).astype(np.float64)
        share = np.add.reduceat(seen, coarse.first[:-1]) / np.diff(coarse.first)
        facing = mesh.facing(toward)[coarse.samples.pair_face]
        unclear = np.flatnonzero(facing & self._at_edges(share, facing)[coarse.samples.pair_pixel])
        if len(unclear) == 0:
            return share
        start, count = self._fine.first[unclear], np.diff(self._fine.first)[unclear]
        offset = np.repeat(np.cumsum(count) - count, count)
        chosen = np.repeat(start, count) + np.arange(len(offset)) - offset
        samples = self._fine.samples
        face = samples.face[chosen]
        lit = mesh.sees(toward, face, mesh.lifted(face, samples.x[chosen], samples.y[chosen]))
        share[unclear] = np.add.reduceat(lit.astype(np.float64), np.cumsum(count) - count) / count
        return share

    def _at_edges(self, share: Array, facing: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether each pixel (pixels,) or its neighbours have lit and dark parts that face the light."""
        camera, pixel = self._camera, self._fine.samples.pair_pixel

        def some(which: NDArray[np.bool_]) -> NDArray[np.bool_]:
            here = np.bincount(pixel[which], minlength=camera.pixels).reshape(camera.rows, camera.cols) > 0
            beside = np.pad(here, 1)
            return (
                here | beside[:-2, 1:-1] | beside[2:, 1:-1] | beside[1:-1, :-2] | beside[1:-1, 2:]
            ).ravel()

        return some(facing & (share > 0.0)) & some(facing & (share < 1.0))
