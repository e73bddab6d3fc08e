"""Many reliefs under many lights, from straight above: each parallel light alone, and ambient light.

The camera sees the same faces in the same shares of each pixel whatever the heights, and a face's radiance
has a closed form (`visual.exact.shading`, by Mitsuba's own material): all that is left is what of each face
a light
reaches. For a parallel light Mitsuba's shadow rays tell; most of the plate lies wholly in light or in shadow,
and only where a few rays disagree are many traced. For ambient light the horizon is found exactly
(`visual.reference.horizon`), and the light above it summed over elevation and azimuth.

How near they come to converged renders, and in what time, stands in docs/learned.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visual.backend.plate import plate_bsdf
from visual.exact.shading import unshadowed
from visual.geometry.film_samples import PictureSamples, film_points, samples_from_above
from visual.geometry.placed_mesh import PlacedMesh
from visual.geometry.topology import PlateTopology, plate_topology
from visual.lights.parallel import ParallelLights
from visual.reference.horizon import horizon_tangent
from visual.scene import Scene

Array = NDArray[np.float64]
Index = NDArray[np.int64]

STRATA = 12
"""Shadow rays along a pixel's side where light and shadow meet."""
FEWEST_STRATA = 6
"""So that every part of a face in a pixel has a ray."""
COARSE_RAYS = 2
"""Shadow rays to each part of a face in a pixel, to find out where they meet; 8 make no picture better."""
AZIMUTHS = 8
"""Directions of the horizon from a point in each part of a face in a pixel; drawn for each point anew."""
ELEVATIONS = 3
"""Nodes of Gauss and Legendre between horizon and zenith: within 0.04 % of 8 nodes on average."""


@dataclass(frozen=True)
class _Points:
    """Points on the plate.

    Attributes:
        samples: what they are.
        first: (pairs + 1,) where those of each pair begin; they are sorted by pair.
    """

    samples: PictureSamples
    first: Index


class ReferenceRenderer:
    """The plate of a scene before a camera straight above, with a pixel at each height sample."""

    def __init__(self, scene: Scene, strata: int = STRATA, seed: int = 0) -> None:
        """Fix the points where light is looked for, by `seed`.

        Args:
            strata: shadow rays along a pixel's side where light and shadow meet, at least 6.

        Raises:
            ValueError: the camera is not straight above, or has other than a pixel at each sample; too few
            strata.
        """
        if strata < FEWEST_STRATA:
            raise ValueError(f"at least {FEWEST_STRATA} strata are needed")
        loaded = scene.light_scenes()[0]
        self._loaded, self._camera = loaded, loaded.cameras[0]
        rows, cols = scene.heights.shape
        if not self._camera.overhead or scene.resolution != (rows, cols):
            raise ValueError("the camera must look straight down, with one pixel at each height sample")
        self._bsdf = plate_bsdf(loaded.scene)
        self._plate = plate_topology(rows, cols, scene.size_mm)
        random = np.random.default_rng(seed)
        film = film_points(self._camera, strata, random)
        self._fine = _sorted(samples_from_above(self._plate, self._camera, film, strata**2), random)
        self._coarse = _thinned(self._fine, COARSE_RAYS)
        self._single = _thinned(self._fine, 1)
        self._share = _shares(self._plate, self._fine.samples)

    def parallel_pictures(self, heights: Array, toward: Array, irradiance: float = np.pi) -> Array:
        """Radiance (lights, rows, cols) under each of some parallel lights alone.

        Args:
            heights: (rows, cols) mm.
            toward: (lights, 3) unit vectors toward the lights.
            irradiance: on a plane that faces the light.
        """
        lights = ParallelLights(toward, np.full(len(toward), irradiance))
        posed = self._pose(heights)
        radiance = unshadowed(self._bsdf, *posed.slopes, lights, self._camera.toward(posed.centres))[
            :, self._coarse.samples.pair_face
        ]
        starts = _lifted(posed, self._coarse)
        pictures = []
        for direction, full in zip(toward, radiance, strict=True):
            lit = self._lit_share(posed, direction, starts)
            pictures.append(self._picture(full * lit))
        return np.stack(pictures)

    def ambient_picture(self, heights: Array, seed: int, azimuths: int = AZIMUTHS) -> Array:
        """Radiance (rows, cols) under ambient light of radiance 1.

        Args:
            heights: (rows, cols) mm.
            seed: of the azimuths, which are unbiased.
            azimuths: to each point.
        """
        random = np.random.default_rng(seed)
        return self._picture(_sky(self._bsdf, self._pose(heights), self._single.samples, azimuths, random))

    def _pose(self, heights: Array) -> PlacedMesh:
        self._loaded.set_heights(heights)
        return PlacedMesh(self._loaded.scene, self._plate, heights)

    def _picture(self, radiance: Array) -> Array:
        """(rows, cols), of the radiance (pairs,) of each part of a face in a pixel."""
        samples, camera = self._fine.samples, self._camera
        picture: Array = np.zeros(camera.pixels)
        picture += np.bincount(samples.pair_pixel, radiance * self._share, minlength=camera.pixels)
        return picture.reshape(camera.rows, camera.cols)

    def _lit_share(self, posed: PlacedMesh, toward: Array, starts: Array) -> Array:
        """(pairs,): what of each face in a pixel sees the light."""
        coarse = self._coarse
        found = np.add.reduceat(
            posed.sees(toward, coarse.samples.face, starts).astype(np.float64), coarse.first[:-1]
        )
        share = found / np.diff(coarse.first)
        facing = posed.facing(toward)[coarse.samples.pair_face]
        unclear = np.flatnonzero(facing & self._at_edges(share, facing)[coarse.samples.pair_pixel])
        if len(unclear) == 0:
            return share
        begin, count = self._fine.first[unclear], np.diff(self._fine.first)[unclear]
        offset = np.repeat(np.cumsum(count) - count, count)
        chosen = np.repeat(begin, count) + np.arange(len(offset)) - offset
        samples = self._fine.samples
        face = samples.face[chosen]
        lit = posed.sees(toward, face, posed.lifted(face, samples.x[chosen], samples.y[chosen]))
        share[unclear] = np.add.reduceat(lit.astype(np.float64), np.cumsum(count) - count) / count
        return share

    def _at_edges(self, share: Array, facing: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(pixels,): whether faces that look toward the light are lit here and dark here or next to it."""
        camera, pixel = self._camera, self._fine.samples.pair_pixel

        def some(which: NDArray[np.bool_]) -> NDArray[np.bool_]:
            here = np.bincount(pixel[which], minlength=camera.pixels).reshape(camera.rows, camera.cols) > 0
            beside = np.pad(here, 1)
            return (
                here | beside[:-2, 1:-1] | beside[2:, 1:-1] | beside[1:-1, :-2] | beside[1:-1, 2:]
            ).ravel()

        return some(facing & (share > 0.0)) & some(facing & (share < 1.0))


def _sky(
    bsdf: Any, posed: PlacedMesh, samples: PictureSamples, azimuths: int, random: np.random.Generator
) -> Array:
    """(samples,) radiance toward the zenith under ambient light of radiance 1."""
    import drjit as dr
    import mitsuba as mi

    count = len(samples.face)
    lane = dr.arange(mi.UInt32, count * azimuths)
    point = lane // azimuths

    def of_points(values: Array) -> Any:
        return dr.gather(mi.Float, mi.Float(np.ascontiguousarray(values, dtype=np.float32)), point)

    first = posed.vertices[posed.plate.faces[samples.face, 0]]
    p, q = (slope[samples.face] for slope in posed.slopes)
    z = first[:, 2] + p * (samples.x - first[:, 0]) + q * (samples.y - first[:, 1])
    slope_x, slope_y = of_points(p), of_points(q)
    turn = mi.Float(lane - point * azimuths) + of_points(random.uniform(size=count))
    up, across = dr.sincos(turn * (2.0 * np.pi / azimuths))
    rise = horizon_tangent(
        posed.heights,
        posed.plate.size_mm,
        of_points(samples.x),
        of_points(samples.y),
        of_points(z),
        across,
        up,
    )
    lowest = dr.atan(dr.maximum(rise, slope_x * across + slope_y * up))

    frame = mi.Frame3f(dr.normalize(mi.Vector3f(-slope_x, -slope_y, 1.0)))
    si = dr.zeros(mi.SurfaceInteraction3f, count * azimuths)
    si.n, si.sh_frame, si.wi = frame.n, frame, frame.to_local(mi.Vector3f(0.0, 0.0, 1.0))
    half = 0.5 * (0.5 * np.pi - lowest)
    total = dr.zeros(mi.Float, count * azimuths)
    for node, weight in zip(*np.polynomial.legendre.leggauss(ELEVATIONS), strict=True):
        sine, cosine = dr.sincos(lowest + half * (1.0 + float(node)))
        toward = mi.Vector3f(cosine * across, cosine * up, sine)
        value = bsdf.eval(mi.BSDFContext(), si, frame.to_local(toward))
        total += float(weight) * half * cosine * (value[0] if mi.is_monochromatic else mi.luminance(value))
    each = np.asarray(total, dtype=np.float64).reshape(count, azimuths)
    return np.asarray(each.sum(1) * (2.0 * np.pi / azimuths))


def _shares(plate: PlateTopology, samples: PictureSamples) -> Array:
    """(pairs,): the area of each face in a pixel as a part of the pixel, exactly.

    A cell between four samples is cut in two along its second diagonal; each of its corners lies in another
    pixel, which takes a quarter of it, or all there is along the sides of the plate.
    """
    cell, second = np.divmod(samples.pair_face, 2)
    cell_row, cell_col = np.divmod(cell, plate.cols + 1)
    row, col = np.divmod(samples.pair_pixel, plate.cols)
    u = _part_of_cell(cell_col, col, plate.cols)
    v = _part_of_cell(cell_row, row, plate.rows)

    def triangle(side: Array) -> Array:
        return np.asarray(0.5 * np.maximum(side, 0.0) ** 2)

    before = (
        triangle(1 - u[0] - v[0])
        - triangle(1 - u[1] - v[0])
        - triangle(1 - u[0] - v[1])
        + triangle(1 - u[1] - v[1])
    )
    whole = (u[1] - u[0]) * (v[1] - v[0])
    return np.asarray(np.where(second == 1, whole - before, before) * u[2] * v[2])


def _part_of_cell(cell: Index, pixel: Index, samples: int) -> tuple[Array, Array, Array]:
    """From where to where in a cell a pixel reaches, in [0, 1], and the cell's width in pixels."""
    border = (cell == 0) | (cell == samples)
    right = cell == pixel + 1
    start = np.where(border | right, 0.0, 0.5)
    end = np.where(border | ~right, 1.0, 0.5)
    return start, end, np.where(border, 0.5, 1.0)


def _sorted(samples: PictureSamples, random: np.random.Generator) -> _Points:
    """By pair; in random order within each, so that the first few of any lie all over it."""
    shuffled = random.permutation(len(samples.pair))
    return _chosen(samples, shuffled[np.argsort(samples.pair[shuffled], kind="stable")])


def _thinned(points: _Points, most: int) -> _Points:
    """The first `most` of each pair."""
    pair = points.samples.pair
    rank = np.arange(len(pair)) - points.first[pair]
    return _chosen(points.samples, np.flatnonzero(rank < most))


def _chosen(samples: PictureSamples, order: Index) -> _Points:
    kept = replace(
        samples,
        x=samples.x[order],
        y=samples.y[order],
        face=samples.face[order],
        pair=samples.pair[order],
    )
    return _Points(kept, np.searchsorted(kept.pair, np.arange(len(samples.pair_pixel) + 1)))


def _lifted(posed: PlacedMesh, points: _Points) -> Array:
    samples = points.samples
    return posed.lifted(samples.face, samples.x, samples.y)
