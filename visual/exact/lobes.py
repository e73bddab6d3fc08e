"""Lobes: mirror-smooth and narrow parts of a material, sampled along the directions that they reflect.

Fixed lights never stand where a mirror looks, and are too few for a highlight narrower than their distance. A
narrow lobe is sampled instead: its directions turn with the face, and the light is looked up along each. The
power heuristic (Veach and Guibas 1995) shares the radiance. With p the density of the lobes, d that of the
fixed lights, c = `ENOUGH` and w = (c p)^2 / ((c p)^2 + d^2),

    radiance = sum of f E (1 - w) over fixed lights + mean of f L w / p over sampled directions,

a sum of smooth functions of the face's slopes. A mirror has one direction, no density and the share 1.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index
from visual.backend.mitsuba import dr, mi
from visual.exact.face_shading import FixedShare, ShadedFaces, Shading, ShadingPoints
from visual.geometry.placed_mesh import PlacedMesh
from visual.lights.seen import SeenLight, luminance

SAMPLES = 16
"""Directions sampled from each narrow lobe on each face."""
STEPS = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0])
"""Steps, of which the whole part does not count, by which the numbers of a face's samples follow one another:
irrational, so that the samples are evenly spread (Kronecker sequence)."""
ENOUGH = 4.0
"""Fixed lights within a lobe by which it is seen as well as by sampled directions."""
NARROW = 1.0
"""Least peak density, per steradian, of a lobe that is sampled."""
TRIED = 16
"""Places along each side of the plate, and directions at each, by which the peak density is found."""


@dataclass(frozen=True)
class Reflections:
    """Radiance that faces, or points, show by sampled directions, were nothing in the way.

    Attributes:
        shading: (directions, faces) each.
        toward: (directions, faces, 3) unit vectors.
        light: that is met.
    """

    shading: Shading
    toward: Array
    light: SeenLight

    def lit(self, mesh: PlacedMesh, face: Index, points: Array, column: Index) -> Iterator[NDArray[np.bool_]]:
        """Whether points see the light, direction by direction; they see none where nothing is reflected.

        Args:
            mesh: the plate.
            face: (points,) on which each point lies.
            points: (points, 3) mm, of `PlacedMesh.lifted`.
            column: (points,) of each point among the faces of `shading`.
        """
        for radiance, directions in zip(self.shading.radiance, self.toward, strict=True):
            lit = radiance[column] != 0.0
            some = np.flatnonzero(lit)
            at, toward = points[some], directions[column[some]]
            lit[some] = mesh.sees(toward, face[some], at, self.light.distance(at, toward), through=True)
            yield lit


@dataclass(frozen=True)
class Lobes:
    """The parts of a material that are sampled.

    Attributes:
        bsdf: the material.
        mirrors: numbers of its mirror-smooth components.
        narrow: numbers of its narrow ones, and of those that light passes.
        numbers: (faces, 5) random, in [0, 1), fixed, by which the samples of each face are shifted.
        blur: change of a face's slopes, up and down, over which what the face shows is averaged.
    """

    bsdf: Any
    mirrors: tuple[int, ...]
    narrow: tuple[int, ...]
    numbers: Array
    blur: float = 0.0

    def fixed_share(self, light: SeenLight) -> FixedShare:
        """Share of the radiance under the fixed lights of a light."""

        def share(si: Any, local: Any, points: Any, toward: Any) -> Any:
            density = light.density(light.along(points, toward)[0], toward, local.z)
            return density**2 / (density**2 + (ENOUGH * self._density(si, local)) ** 2)

        return share

    def reflections(
        self,
        slope_x: Array,
        slope_y: Array,
        face: Index,
        light: SeenLight,
        toward_camera: Array,
        places: ShadingPoints,
        derivatives: bool,
    ) -> Reflections:
        """What faces of given slopes show of a light; `face` has their numbers, the rest is as of `shade`."""
        rows = []
        for component in (*self.mirrors, *self.narrow):
            count = 1 if component in self.mirrors and not self.blur else SAMPLES
            faces = ShadedFaces(slope_x, slope_y, toward_camera, places, count)
            rows.append(self._of_component(component, faces, self._random(face, count), light, derivatives))
        shadings, directions = zip(*rows, strict=True)
        values = zip(*(shading.values for shading in shadings), strict=True)
        return Reflections(Shading(*map(np.concatenate, values)), np.concatenate(directions), light)

    def _of_component(
        self,
        component: int,
        faces: ShadedFaces,
        random: list[Any],
        light: SeenLight,
        derivatives: bool,
    ) -> tuple[Shading, Array]:
        """What faces show by one component, and in which directions."""
        axes: list[Any] = []

        def radiance(p: Any, q: Any, rise: Any) -> Any:
            p, q = (
                slope + self.blur * (2.0 * part - 1.0) for slope, part in zip((p, q), random[3:], strict=True)
            )
            si, frame, points = faces.at(p, q, rise)
            sample, weight = self.bsdf.sample(_context(component), si, random[0], mi.Point2f(random[1:3]))
            toward = frame.to_world(sample.wo)
            axes[:] = dr.detach(toward)
            seen, _ = light.along(points, toward)
            if component in self.mirrors:
                return luminance(weight * seen) / faces.count
            value = luminance(self.bsdf.eval(mi.BSDFContext(), si, sample.wo) * seen)
            density, fixed = self._density(si, sample.wo), light.density(seen, toward, sample.wo.z)
            value *= density / (faces.count * (density**2 + (fixed / ENOUGH) ** 2))
            return dr.select(sample.pdf > 0.0, value, 0.0)

        return faces.shading(radiance, derivatives), np.stack([faces.numbers(axis) for axis in axes], axis=2)

    def _density(self, si: Any, local: Any) -> Any:
        """Density, per steradian, of all sampled directions but those of mirrors."""
        density = mi.Float(0.0)
        for component in self.narrow:
            density += self.bsdf.pdf(_context(component), si, local)
        return density

    def _random(self, face: Index, count: int) -> list[Any]:
        """Five numbers in [0, 1) for each of `count` samples of each face, evenly spread on every face."""
        values = (np.outer(np.arange(count), STEPS)[:, None] + self.numbers[face]) % 1.0
        return [
            mi.Float(np.ascontiguousarray(axis.ravel(), dtype=np.float32))
            for axis in np.moveaxis(values, 2, 0)
        ]


def lobes_of(bsdf: Any, faces: int, seed: int, blur: float = 0.0, narrow: bool = True) -> Lobes | None:
    """The lobes of a material that fixed lights would miss; None if there are none.

    Args:
        bsdf: of a plate.
        faces: of the plate.
        seed: of the numbers of the samples.
        blur: see `Lobes`.
        narrow: whether narrow lobes count, not mirrors alone.
    """
    flags = [int(bsdf.flags(number)) for number in range(bsdf.component_count())]
    front = [number for number, flag in enumerate(flags) if flag & int(mi.BSDFFlags.FrontSide)]
    mirrors = tuple(number for number in front if flags[number] & int(mi.BSDFFlags.Delta))
    glossy = (number for number in front if narrow and flags[number] & int(mi.BSDFFlags.Glossy))
    through = int(mi.BSDFFlags.Transmission)
    narrow_ones = tuple(n for n in glossy if flags[n] & through or _peak(bsdf, n) > NARROW)
    if not mirrors and not narrow_ones:
        return None
    numbers = np.random.default_rng(seed).uniform(size=(faces, len(STEPS)))
    return Lobes(bsdf, mirrors, narrow_ones, numbers, blur)


def _peak(bsdf: Any, component: int) -> float:
    """Greatest density, per steradian, among directions of a component of a flat plate seen from above."""
    place = mi.Float((np.arange(TRIED) + 0.5) / TRIED)
    x, y, first = dr.meshgrid(place, place, place)
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(x))
    si.wi, si.uv = mi.Vector3f(0.0, 0.0, 1.0), mi.Point2f(x, y)
    si.n, si.sh_frame = mi.Normal3f(0.0, 0.0, 1.0), mi.Frame3f(si.wi)
    sample, _ = bsdf.sample(_context(component), si, first, mi.Point2f(first, y))
    return float(np.max(np.asarray(sample.pdf)))


def _context(component: int) -> Any:
    context = mi.BSDFContext()
    context.component = component
    return context
