"""Feel of filament: what fingers get from the beads of a sliced part, by place and by side of the part."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Self, get_args

import numpy as np
import torch

import tactile
from optimize.verification.solids.mesh_feel import ESTIMATED, PART, TAKEN_OUT, MeshFeel, pressed
from optimize.verification.solids.own_shape import better
from optimize.verification.surface_bands import surface_bands
from optimize.verification.verification import SurfaceBand
from relief.ground.arrays import Array
from relief.ground.errors import naming
from relief.ground.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.ground.progress import stage
from relief.ground.threads import one_torch_thread
from relief.solids.body import Body
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.beads import SlicedPart
from relief.solids.filament.object_place import Region, offset_of, region_of
from relief.solids.filament.sliced_shape import shape_of
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import EDGE_SHARE, Cropper, SurfaceCrop, reachable
from relief.solids.meshes.mesh_places import Frame, frames, spread, surface_points
from relief.solids.objects.torus import fitted, over, torus
from tactile.model import ModelName

MOST_TRIED, MOST_PLACES = 300, 80
"""Most places on the beads of a part that are tried for edges, and that are pressed: a crop of beads has four
times as many samples as that of a mesh."""
WIDE_MM, COARSE, EVERY = 9.0, 64, 2
"""Radius of the disc to which a torus is fitted, mm; samples along its diameter; stride of the fit."""
FARTHER = 1.05
"""Factor by which points on the patch may vary more over the torus of the disc than over the torus of the
patch."""
BENT_PER_MM = 0.008
"""Root sum square of both curvatures of a torus, 1/mm, below which the torus counts as a plane: that of a
ball of 180 mm radius, 0.03 mm rms on 10 mm. Fuzzy skin of 0.3 mm on a flat side bends a torus by a third."""
SQUARE_MM, UNEVEN_MM = 2.0, 0.1
"""Side of the squares over which distances from a torus are averaged, mm, and their rms, mm, above which a
patch lies on an edge: fuzzy skin of 0.5 mm leaves 0.06, a rim of 45 degrees 1 mm within the patch 0.2."""
_Place = tuple[list[SurfaceCrop], Array]
"""Crops of prints at a contact location, and the torus (6,) that is taken out there."""
FINE, MOST_BAND_PLACES = 512, 2
"""Samples along 10 mm, and most places of a region, by which bands of wavelength are measured: on 256, layers
of 0.12 mm alias into waves of 1.6 to 3.2 mm of 0.95 um, which are 0.03 um."""


@dataclass(frozen=True)
class BeadFeel(MeshFeel):
    """What fingers get from a sliced part.

    Attributes:
        regions: Of the k places: "top", "slope", "side", "overhang" or "bottom", by the axis of the finger.
        bands: Waves of the skin's surface by region, from top to bottom; layer lines are such waves.
    """

    regions: tuple[str, ...]
    bands: dict[str, tuple[SurfaceBand, ...]]

    def by_region(self) -> dict[str, Self]:
        """The feel of each region that has places, from top to bottom."""
        return {name: self._within(name) for name in self.bands}

    def _within(self, name: str) -> Self:
        """The feel of the places of a region."""
        chosen = [number for number, region in enumerate(self.regions) if region == name]
        return replace(
            self,
            crops=[self.crops[number] for number in chosen],
            values={key: values[chosen] for key, values in self.values.items()},
            contact_fractions=self.contact_fractions[chosen],
            as_pressed={key: values[chosen] for key, values in self.as_pressed.items()},
            regions=(name,) * len(chosen),
            bands={name: self.bands[name]},
        )

    def details(self, first: MeshFeel | None = None) -> dict[str, Any]:
        """As of a mesh, with the region of each place."""
        details = super().details(first)
        for touch, region in zip(details["touches"], self.regions, strict=True):
            touch["region"] = region
        return details


def feel_of_beads(
    parts: Sequence[SlicedPart],
    skin: tactile.Skin,
    model: ModelName = "layer",
    most: int = MOST_PLACES,
    without_texture: Mesh | None = None,
    region: Region | None = None,
) -> list[BeadFeel]:
    """Press the skin on the beads of prints of one part, at the same places of all.

    Places lie 2.5 mm apart, or farther where these are more than `most`, all over the part, the side on the
    bed included. A place on whose patch any of the prints has an edge is left out, unless all are on edges.

    Args:
        parts: Prints of the part; places are those of the first.
        skin: The finger.
        model: Of touch.
        most: Most places.
        without_texture: The object that was sliced, which gives places and axes, and whose curvature is taken
            out. Without the object the outer walls give places and axes; curvature is estimated from each
            patch, and is a part of the roughness where all places are on edges.
        region: Of the places; None: all. The list is empty if the region has no place.

    Raises:
        InputError: The object is not that of the beads, or the prints are not of one part.
        ContactError: A contact does not converge.
    """
    surfaces = [BeadSurface(part.beads, side_mm=skin.patch_mm) for part in parts]
    printed = [shape_of(part.beads) for part in parts]
    body = printed[0]
    if without_texture is not None:
        with naming(without_texture.path):
            bare = without_texture.body
            body = Body(bare.vertices + offset_of(body, bare), bare.faces)
    ways = [np.zeros(3)]
    for part, shape in zip(parts[1:], printed[1:], strict=True):
        with naming(part.path):
            # From the first print to the other, whose name an error begins with.
            ways.append(-offset_of(printed[0], shape, parts[0].path.name))
    points = surface_points(body, with_bed=True)
    candidates = spread(points.at, MOST_TRIED)
    places, tried = list[_Place](), list[Frame]()
    with stage("looking at places", len(candidates), at_most=True) as advance:
        for frame in frames(points, candidates):
            advance()
            if region not in (None, region_of(frame.axes[2])):
                continue
            # On samples as few as a torus needs, since most places of a small part lie on edges.
            nearest, uneven_mm = nearest_torus(surfaces[0], frame)
            crops = _crops(frame, surfaces, ways) if uneven_mm <= UNEVEN_MM else []
            if crops and not any(crop.on_edge for crop in crops):
                places.append((crops, nearest))
            else:
                tried.append(frame)
            if len(places) == most:
                break
    edges = len(tried) if places else 0
    if not places and region is None:
        for frame in tried[:most]:
            crops = [replace(crop, on_edge=True) for crop in _crops(frame, surfaces, ways)]
            places.append((crops, np.zeros(6)))
    if not places:
        return []
    regions = tuple(region_of(crops[0].frame.axes[2]) for crops, _ in places)
    shapes = None if without_texture is None else Cropper(body, side_mm=skin.patch_mm)
    curvature = TAKEN_OUT if shapes is not None else PART if places[0][0][0].on_edge else ESTIMATED
    feels = []
    for number, way in enumerate(ways):
        crops = [prints[number] for prints, _ in places]
        alone = partial(_alone, shapes=shapes, way=way)
        heights = np.stack([alone(prints[number], shape) for prints, shape in places])
        values, fractions = pressed(heights, skin, model, crops[0].side_mm, thinned=True)
        fine = BeadSurface(parts[number].beads, FINE, skin.patch_mm)
        bands: dict[str, tuple[SurfaceBand, ...]] = {}
        for name in filter(regions.__contains__, get_args(Region)):
            there = [place for place, own in zip(places, regions, strict=True) if own == name]
            some = there[:: -(-len(there) // MOST_BAND_PLACES)]
            finer = [alone(fine.crop(prints[number].frame), shape) for prints, shape in some]
            bands[name] = _bands(np.stack(finer), crops[0].side_mm, skin, model)
        # Triangles of the shape are small enough for a colour at each corner.
        of_mesh = printed[number], crops, values, fractions, edges, 0, points.area_mm2, curvature, values
        feels.append(BeadFeel(*of_mesh, regions, bands))
    return feels


def _crops(frame: Frame, surfaces: Sequence[BeadSurface], ways: Sequence[Array]) -> list[SurfaceCrop]:
    """Crops of prints at a place of the first, each a way (3,) mm from it."""
    return [
        surface.crop(Frame(frame.at + way, frame.axes)) for surface, way in zip(surfaces, ways, strict=True)
    ]


def _alone(crop: SurfaceCrop, shape: Array, shapes: Cropper | None, way: Array) -> Array:
    """Heights (n, n) mm of beads over the object, or without one over a torus (6,)."""
    return over_torus(crop, shape) if shapes is None else over_object(crop, shapes, way)


def over_object(crop: SurfaceCrop, shapes: Cropper, way: Array) -> Array:
    """Heights (n, n) mm of beads over the object that was sliced, along the object's normals nearly.

    Args:
        crop: Of the beads.
        shapes: Of the object.
        way: From the object to the beads, mm.
    """
    frame = Frame(crop.frame.at - way, crop.frame.axes)
    shape = shapes.heights(frame, crop.side_mm, len(crop.heights), 2.0 * HEIGHT_LIMIT_MM)
    with np.errstate(invalid="ignore"):  # The shape is infinitely low beyond its rim.
        return _above(crop, shape, *np.gradient(shape, crop.side_mm / len(shape)))


def nearest_torus(surface: BeadSurface, frame: Frame) -> tuple[Array, float]:
    """The torus (6,) nearest to beads around a place, and the distance between both on the patch, mm rms.

    The torus is fitted on a disc that is wider than the patch, so that waves of the beads average out, or to
    the patch where the disc holds another surface. Distances are means over squares of 2 mm, in which beads
    average out, too. They are infinite where the patch reaches over an edge.
    """
    at = (np.arange(COARSE) + 0.5) * (2.0 * WIDE_MM / COARSE) - WIDE_MM
    x, y = np.meshgrid(at, at[::-1])
    points = np.stack([x, y, surface.heights(frame, 2.0 * WIDE_MM, COARSE)], axis=2)
    patch = points[np.abs(points[..., :2]).max(axis=2) < 0.5 * PATCH_SIDE_MM]
    level = patch[:, 2].max() - HEIGHT_LIMIT_MM
    on_patch = patch[patch[:, 2] > level]
    if not np.isfinite(level) or len(on_patch) < (1.0 - EDGE_SHARE) * len(patch):
        return np.zeros(6), np.inf
    around = points[np.abs(points[..., 2] - level - HEIGHT_LIMIT_MM) < HEIGHT_LIMIT_MM]
    around = around[np.hypot(*around.T[:2]) < WIDE_MM]
    shape = better(fitted(around[::EVERY]), fitted(on_patch[::EVERY]), on_patch, FARTHER)
    away = over(shape, *on_patch.T)
    col, row = np.floor(on_patch.T[:2] / SQUARE_MM).astype(np.int64)
    _, square, counts = np.unique(row * COARSE + col, return_inverse=True, return_counts=True)
    return shape, float((np.bincount(square, away) / counts).std())


def over_torus(crop: SurfaceCrop, shape: Array) -> Array:
    """Heights (n, n) mm of beads over a torus (6,); those of the crop where the torus is nearly a plane."""
    if np.hypot(*shape[4:]) < BENT_PER_MM:
        return crop.heights
    at = ((np.arange(len(crop.heights)) + 0.5) / len(crop.heights) - 0.5) * crop.side_mm
    x, y = np.meshgrid(at, at[::-1])
    return _above(crop, *torus(shape, x, y))


def _above(crop: SurfaceCrop, base: Array, by_x: Array, by_y: Array) -> Array:
    """Heights (n, n) mm over a shape, along its normals nearly, as far as a finger reaches.

    Args:
        crop: Of the beads.
        base: Heights of the shape, mm; -inf beyond its rim.
        by_x, by_y: Slopes of the shape, of any signs.
    """
    with np.errstate(invalid="ignore"):
        above = (crop.heights + crop.level_mm - base) / np.sqrt(1.0 + by_x**2 + by_y**2)
    there = np.isfinite(above) & (crop.heights > 0.0)
    return reachable(np.where(there, above, -np.inf), crop.side_mm)[0]


@one_torch_thread()
def _bands(heights: Array, side_mm: float, skin: tactile.Skin, model: ModelName) -> tuple[SurfaceBand, ...]:
    """Bands of the skin's surface on patches (k, n, n) mm."""
    touch = tactile.press(torch.as_tensor(heights), side_mm, skin, model)
    press = tactile.touch_model(skin, heights.shape[-1], side_mm, model=model)
    surface = np.asarray(press.operator.displacement(touch.pressure / skin.young_modulus_mpa))
    return surface_bands(surface, surface, side_mm)
