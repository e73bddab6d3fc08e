"""Pictures of the plate from straight above and their Jacobian with respect to the heights, as sparse
matrices.

Seen from above by an orthographic camera a picture sample meets the same face whatever the heights, so no
camera ray is traced: a picture is, pixel by pixel, the lit share of each face times that face's radiance.
Its derivative has two parts: radiance by slope (each face's radiance depends on its three heights), and the
motion of shadow boundaries (`visual.edges`). Sample positions are fixed, so that two reliefs differ by
geometry alone, not by noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from visual.edges import EDGE_SAMPLES, LIFT_MM, ShadowEdges, shadow_edges
from visual.lights import ParallelLights
from visual.rays import blocked
from visual.relief import Relief, relief
from visual.shading import shade

Array = NDArray[np.float64]
Index = NDArray[np.int64]

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class PictureSamples:
    """Fixed sample positions of a picture.

    Attributes:
        x, y: (samples,) mm.
        face: (samples,) the face that each sample meets.
        pair: (samples,) which (pixel, face) pair it belongs to.
        pair_pixel, pair_face: (pairs,).
        per_pixel: samples in each pixel.
    """

    x: Array
    y: Array
    face: Index
    pair: Index
    pair_pixel: Index
    pair_face: Index
    per_pixel: int


def picture_samples(
    plate: Relief, resolution: int, strata: int, generator: np.random.Generator
) -> PictureSamples:
    """Jittered samples, `strata` x `strata` in each pixel of a square picture that the plate fills."""
    fine = resolution * strata
    row, col = np.meshgrid(np.arange(fine), np.arange(fine), indexing="ij")
    jitter = generator.uniform(size=(2, fine, fine))
    x = ((col + jitter[0]) / fine - 0.5).ravel() * plate.size_mm
    y = (0.5 - (row + jitter[1]) / fine).ravel() * plate.size_mm
    pixel = ((row // strata) * resolution + col // strata).ravel()
    face = face_at(plate, x, y)
    key, pair = np.unique(pixel * len(plate.faces) + face, return_inverse=True)
    return PictureSamples(x, y, face, pair, key // len(plate.faces), key % len(plate.faces), strata**2)


def face_at(plate: Relief, x: Array, y: Array) -> Index:
    """The face under each point of the plate, (points,)."""
    across, down = _cell(plate.cols, plate.size_mm, x), _cell(plate.rows, plate.size_mm, -y)
    second = across[1] + down[1] >= 1.0
    return 2 * (down[0] * (plate.cols + 1) + across[0]) + second


def _cell(samples: int, size_mm: float, position: Array) -> tuple[Index, Array]:
    """Cell between grid lines, and how far across it, of a coordinate; outermost cells are half as wide."""
    place = (position / size_mm + 0.5) * samples + 0.5
    cell = np.clip(np.floor(place).astype(np.int64), 0, samples)
    within = place - cell
    within = np.where(cell == 0, 2.0 * within - 1.0, np.where(cell == samples, 2.0 * within, within))
    return cell, within


@dataclass(frozen=True)
class TopPictures:
    """Pictures and their Jacobians.

    Attributes:
        pictures: (conditions, rows, cols) radiance.
        jacobians: for each condition (pixels, heights) d radiance / d mm; empty if not asked for.
    """

    pictures: Array
    jacobians: tuple[sp.csr_matrix, ...]


class TopView:
    """A plate under a camera straight above, lit by one parallel light at a time and ambient light."""

    def __init__(
        self,
        scene: Any,
        bsdf: Any,
        set_heights: Any,
        shape: tuple[int, int],
        size_mm: float,
        resolution: int,
        suns: ParallelLights,
        ambient: ParallelLights | None,
        seed: int = 0,
        strata: int = 4,
        ambient_strata: int = 2,
    ) -> None:
        """Fix the samples.

        Args:
            scene: Mitsuba scene that holds the plate; used for rays only.
            bsdf: the plate's material.
            set_heights: puts heights (rows, cols) into `scene`.
            shape: rows and cols of the height map.
            resolution: pixels a side.
            suns: one condition each; with none, the one condition is ambient light alone.
            ambient: added to every condition; None if there is none.
            strata, ambient_strata: samples along a pixel's side for suns and for each ambient direction.
        """
        generator = np.random.default_rng(seed)
        self._scene, self._bsdf, self._set_heights = scene, bsdf, set_heights
        self._plate = relief(*shape, size_mm)
        self._resolution = resolution
        self._suns, self._ambient = suns, ambient
        self._samples = picture_samples(self._plate, resolution, strata, generator)
        self._ambient_samples = picture_samples(self._plate, resolution, ambient_strata, generator)
        self._jitter = generator.uniform(size=(len(self._plate.edge_start), EDGE_SAMPLES))

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> TopPictures:
        """Pictures of a relief, and their Jacobians.

        Args:
            heights: (rows, cols) mm.
            jacobian: whether derivatives are wanted.
            edges: whether they include the motion of shadow boundaries.
        """
        self._set_heights(heights)
        slopes = self._plate.slopes(heights)
        pictures, derivatives = [], []
        for number in range(len(self._suns)):
            sun = ParallelLights(self._suns.toward[[number]], self._suns.irradiance[[number]])
            picture, entries = self._lit_by(sun, self._samples, heights, slopes, jacobian, edges)
            pictures.append(picture)
            derivatives.append(entries)
        if self._ambient is not None:
            ambient, entries = self._lit_by(
                self._ambient, self._ambient_samples, heights, slopes, jacobian, edges
            )
            pictures = [p + ambient for p in pictures] or [ambient]
            if jacobian:
                derivatives = [d + entries for d in derivatives] or [entries]
        size = (self._resolution, self._resolution)
        return TopPictures(
            np.stack([p.reshape(size) for p in pictures]), tuple(derivatives) if jacobian else ()
        )

    def _lit_by(
        self,
        lights: ParallelLights,
        samples: PictureSamples,
        heights: Array,
        slopes: tuple[Array, Array],
        jacobian: bool,
        edges: bool,
    ) -> tuple[Array, Any]:
        """Picture (pixels,) and Jacobian (pixels, heights) under a set of lights that shine together."""
        shading = shade(self._bsdf, *slopes, lights, UP)
        lit = self._lit_shares(lights, samples, heights, slopes)
        pixels = self._resolution**2

        def gather(values: Array) -> Array:
            return np.einsum("lp,lp->p", lit, values[:, samples.pair_face])

        lit_radiance = gather(shading.radiance)
        picture: Array = np.bincount(samples.pair_pixel, lit_radiance, minlength=pixels).astype(np.float64)
        if not jacobian:
            return picture, None
        by_x, by_y = gather(shading.by_slope_x), gather(shading.by_slope_y)
        face = samples.pair_face
        values = by_x[:, None] * self._plate.slope_x[face] + by_y[:, None] * self._plate.slope_y[face]
        rows = np.repeat(samples.pair_pixel, 3)
        columns = self._plate.sample[self._plate.faces[face]].ravel()
        parts = [(rows, columns, values.ravel())]
        if edges:
            found = shadow_edges(self._scene, self._plate, heights, lights, self._jitter)
            lost = shading.radiance[found.light, found.receiver]
            parts.append(edge_entries(self._plate, found, lost, self._resolution))
        r, c, v = (np.concatenate(p) for p in zip(*parts, strict=True))
        return picture, sp.csr_matrix((v, (r, c)), shape=(pixels, self._plate.rows * self._plate.cols))

    def _lit_shares(
        self, lights: ParallelLights, samples: PictureSamples, heights: Array, slopes: tuple[Array, Array]
    ) -> Array:
        """(lights, pairs): share of the pixel that is this face and sees the light."""
        slope_x, slope_y = slopes[0][samples.face], slopes[1][samples.face]
        first = self._plate.faces[samples.face, 0]
        z = self._plate.vertex_heights(heights)[first]
        z = z + slope_x * (samples.x - self._plate.x[first]) + slope_y * (samples.y - self._plate.y[first])
        points = np.stack((samples.x, samples.y, z + LIFT_MM), axis=1)
        shares = np.empty((len(lights), len(samples.pair_pixel)))
        for number, toward in enumerate(lights.toward):
            facing = np.flatnonzero(toward[2] - slope_x * toward[0] - slope_y * toward[1] > 0.0)
            shadow = blocked(self._scene, points[facing], np.broadcast_to(toward, (len(facing), 3)))
            lit = facing[~shadow]
            shares[number] = np.bincount(samples.pair[lit], minlength=len(samples.pair_pixel))
        return shares / samples.per_pixel


def edge_entries(
    plate: Relief, found: ShadowEdges, radiance: Array, resolution: int
) -> tuple[Index, Index, Array]:
    """Entries d radiance of a pixel / d height of the motion of shadow boundaries: (pixels, height samples,
    values).

    Args:
        found: samples of shadow boundaries.
        radiance: (samples,) what the light in question adds there on the lit side.
        resolution: pixels a side of the picture, which the plate fills.
    """
    pitch = plate.size_mm / resolution
    row = np.clip(np.floor((0.5 * plate.size_mm - found.y) / pitch), 0, resolution - 1)
    col = np.clip(np.floor((0.5 * plate.size_mm + found.x) / pitch), 0, resolution - 1)
    pixel = (row * resolution + col).astype(np.int64)
    values = -(radiance / pitch**2)[:, None] * found.shrinkage
    return np.repeat(pixel, 5), plate.sample[found.vertices].ravel(), values.ravel()
