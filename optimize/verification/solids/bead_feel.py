"""Feel of filament: what fingers get from the beads of a sliced part, by place and by side of the part."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Self, get_args

import numpy as np
import torch

import tactile
from optimize.verification.solids.mesh_feel import (
    ESTIMATED,
    MOST_TRIED,
    TAKEN_OUT,
    MeshFeel,
    pressed,
)
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
from relief.solids.meshes.crops import Cropper, SurfaceCrop, reachable
from relief.solids.meshes.mesh_places import Frame, frames, spread, surface_points
from relief.solids.objects.torus import fitted, over, torus
from tactile.jnd import jnd_unless_smooth
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS

MOST_PLACES = 80
"""Most places on the beads of a part, which takes four times as many samples as a mesh does at one."""
WIDE_MM, COARSE = 9.0, 64
"""Radius of the disc to which a torus is fitted, mm, and samples along its diameter."""
FARTHER = 1.05
"""Factor by which points on the patch may vary more over the torus of the disc than over the patch's own."""
BENT_MM = 0.03
"""Root mean square, mm, by which a torus is no plane on the patch: that of a ball of 170 mm. Fuzzy skin of
0.3 mm on a flat side bends the torus by 0.01 mm."""
SQUARE_MM, UNEVEN_MM = 2.0, 0.1
"""Side of the squares over which distances from a torus are averaged, mm, and their rms, mm, above which a
patch lies on an edge: fuzzy skin of 0.5 mm leaves 0.06, a rim of 45 degrees 1 mm within the patch 0.2."""
MOST_BAND_PLACES = 8
"""Most places of a region whose skin is looked at by bands of wavelength, evenly taken."""


@dataclass(frozen=True)
class BeadFeel(MeshFeel):
    """What fingers get from a sliced part.

    Attributes:
        regions: Of the k places: "top", "slope", "side", "overhang" or "bottom", by the axis of the finger.
        bands: Waves of the skin's surface by region, in which layer lines lie.
        region: That the places were chosen from; None: all.
    """

    regions: tuple[Region, ...]
    bands: dict[Region, tuple[SurfaceBand, ...]]
    region: Region | None = None

    def by_region(self) -> dict[Region, Self]:
        """The feel of each region that has places, from top to bottom."""
        return {name: self.within(name) for name in get_args(Region) if name in self.regions}

    def within(self, name: Region) -> Self:
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
            region=name,
        )

    def details(self, first: MeshFeel | None = None) -> dict[str, Any]:
        """As of a mesh, with the region of each place, and the numbers of each region."""
        details = super().details(first)
        for touch, region in zip(details["touches"], self.regions, strict=True):
            touch["region"] = region
        others = first.by_region() if isinstance(first, BeadFeel) else {}
        details["regions"] = {
            name: {
                **part.means,
                "contact_fraction": part.contact_fraction,
                "places": part.ends,
                "bands": [
                    {
                        "least_mm": band.least_mm,
                        "most_mm": band.most_mm,
                        "rms_um": band.initial_um,
                        "threshold_um": band.threshold_um,
                    }
                    for band in part.bands[name]
                ],
                **({"jnd_from_first": _jnd(part, others[name])} if others else {}),
            }
            for name, part in self.by_region().items()
        }
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

    Places lie 2.5 mm apart, or as many as there may be, all over the part, the side on the bed included. A
    place on whose patch any of the prints has an edge is left out, unless all places are on edges.

    Args:
        parts: Prints of the part; places are those of the first.
        skin: The finger.
        model: Of touch.
        most: Most places.
        without_texture: The object that was sliced, which gives places and axes, and whose curvature is taken
            out. Without it the outer walls give places and axes, and curvature is estimated from each patch.
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
            body = _moved(without_texture.body, offset_of(body, without_texture.body)[0])
    ways = [np.zeros(3)]
    for part, shape in zip(parts[1:], printed[1:], strict=True):
        with naming(part.path):
            ways.append(-offset_of(printed[0], shape)[0])
    points = surface_points(body, with_bed=True)
    candidates = spread(points.at, MOST_TRIED)
    places, tried = list[_Place](), list[_Place]()
    with stage("looking at places", len(candidates), at_most=True) as advance:
        for frame in frames(points, candidates):
            advance()
            if region not in (None, region_of(frame.axes[2])):
                continue
            place = _Place.looked_at(frame, surfaces, ways)
            (tried if place.on_edge else places).append(place)
            if len(places) == most:
                break
    edges = len(tried) if places else 0
    places = places or ([] if region else tried[:most])
    if not places:
        return []
    regions = tuple(region_of(place.crops[0].frame.axes[2]) for place in places)
    shapes = None if without_texture is None else Cropper(body, side_mm=skin.patch_mm)
    curvature = ESTIMATED if shapes is None else TAKEN_OUT
    feels = []
    for number, way in enumerate(ways):
        crops = [place.crops[number] for place in places]
        heights = np.stack(
            [
                over_torus(place.crops[number], place.torus)
                if shapes is None
                else over_object(place.crops[number], shapes, way)
                for place in places
            ]
        )
        values, fractions = pressed(heights, skin, model, crops[0].side_mm, thinned=True)
        bands = _bands_by_region(heights, crops[0].side_mm, regions, skin, model)
        # Triangles of the shape are small enough for a colour at each corner.
        of_mesh = printed[number], crops, values, fractions, edges, 0, points.area_mm2, curvature, values
        feels.append(BeadFeel(*of_mesh, regions, bands))
    return feels


@dataclass(frozen=True)
class _Place:
    """A contact location on prints of a part.

    Attributes:
        crops: Of each print.
        torus: (6,) nearest to the first print around the place.
        on_edge: Whether there is an edge on the patch of any print, or the patch is no part of a torus.
    """

    crops: list[SurfaceCrop]
    torus: Array
    on_edge: bool

    @classmethod
    def looked_at(cls, frame: Frame, surfaces: Sequence[BeadSurface], ways: Sequence[Array]) -> Self:
        """The place of a frame on surfaces of prints, which lie a way (3,) mm from the first."""
        crops = [
            surface.crop(Frame(frame.at + way, frame.axes))
            for surface, way in zip(surfaces, ways, strict=True)
        ]
        if any(crop.on_edge for crop in crops):
            return cls(crops, np.zeros(6), True)
        shape, uneven_mm = nearest_torus(crops[0], surfaces[0])
        return cls(crops, shape, uneven_mm > UNEVEN_MM)


def _jnd(feel: MeshFeel, first: MeshFeel) -> float | None:
    """Just-noticeable differences by which a mean is rougher (+) or smoother; None: one is smooth."""
    return jnd_unless_smooth(feel.means[ROUGHNESS.name], first.means[ROUGHNESS.name])


def _moved(body: Body, way: Array) -> Body:
    """A body that is moved by a way (3,) mm."""
    return Body(body.vertices + way, body.faces)


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
        down, across = np.gradient(shape, crop.side_mm / len(shape))
        above = (crop.heights + crop.level_mm - shape) / np.sqrt(1.0 + down**2 + across**2)
    return _reached(above, crop)


def nearest_torus(crop: SurfaceCrop, surface: BeadSurface) -> tuple[Array, float]:
    """The torus (6,) nearest to beads around a place, and the distance between both on the patch, mm rms.

    The torus is fitted on a disc that is wider than the patch, so that waves of the beads average out, or to
    the patch where the disc holds another surface. Distances are means over squares of 2 mm, in which beads
    average out, too.
    """
    at = (np.arange(COARSE) + 0.5) * (2.0 * WIDE_MM / COARSE) - WIDE_MM
    x, y = np.meshgrid(at, at[::-1])
    z = surface.heights(crop.frame, 2.0 * WIDE_MM, COARSE, 2.0 * HEIGHT_LIMIT_MM)
    points = np.stack([x, y, z], axis=2)
    points = points[np.abs(points[..., 2] - crop.level_mm - HEIGHT_LIMIT_MM) < HEIGHT_LIMIT_MM]
    on_patch = points[np.abs(points[:, :2]).max(axis=1) < 0.5 * PATCH_SIDE_MM]
    if len(on_patch) < 6:  # Fewer points than a torus has parameters, as on the rim of a spiral vase.
        return np.zeros(6), np.inf
    disc, patch = fitted(points[np.hypot(*points.T[:2]) < WIDE_MM]), fitted(on_patch)
    shape = better(disc, patch, on_patch, FARTHER)
    away = over(shape, *on_patch.T)
    col, row = np.floor(on_patch.T[:2] / SQUARE_MM).astype(np.int64)
    _, square, counts = np.unique(row * COARSE + col, return_inverse=True, return_counts=True)
    return shape, float((np.bincount(square, away) / counts).std())


def over_torus(crop: SurfaceCrop, shape: Array) -> Array:
    """Heights (n, n) mm of beads over a torus (6,); those of the crop where the torus is nearly a plane."""
    at = ((np.arange(len(crop.heights)) + 0.5) / len(crop.heights) - 0.5) * crop.side_mm
    x, y = np.meshgrid(at, at[::-1])
    bent = torus(shape, x, y)[0][::8, ::8].ravel()
    plane = np.column_stack([x[::8, ::8].ravel(), y[::8, ::8].ravel(), np.ones(len(bent))])
    if float((bent - plane @ np.linalg.lstsq(plane, bent)[0]).std()) < BENT_MM:
        return crop.heights
    return _reached(over(shape, x, y, crop.heights + crop.level_mm), crop)


def _reached(above: Array, crop: SurfaceCrop) -> Array:
    """Heights (n, n) over a shape, mm, as a finger reaches them: nothing beyond a rim, or out of reach."""
    there = np.isfinite(above) & (crop.heights > 0.0)
    return reachable(np.where(there, above, -np.inf), crop.side_mm)[0]


@one_torch_thread()
def _bands_by_region(
    heights: Array, side_mm: float, regions: Sequence[Region], skin: tactile.Skin, model: ModelName
) -> dict[Region, tuple[SurfaceBand, ...]]:
    """Bands of the skin's surface by region, at some of its places (k, n, n)."""
    bands = {}
    press = tactile.touch_model(skin, heights.shape[-1], side_mm, model=model)
    for region in dict.fromkeys(regions):
        there = [number for number, name in enumerate(regions) if name == region]
        some = np.linspace(0, len(there) - 1, min(len(there), MOST_BAND_PLACES)).round().astype(int)
        touch = tactile.press(torch.as_tensor(heights[np.array(there)[some]]), side_mm, skin, model)
        surface = np.asarray(press.operator.displacement(touch.pressure / skin.young_modulus_mpa))
        bands[region] = surface_bands(surface, surface, side_mm)
    return bands
