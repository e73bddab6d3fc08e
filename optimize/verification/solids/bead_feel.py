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
            ways.append(offset_of(shape, printed[0])[0])
    points = surface_points(body, with_bed=True)
    candidates = spread(points.at, MOST_TRIED)
    tried: list[list[SurfaceCrop]] = []
    left = most
    with stage("looking at places", len(candidates), at_most=True) as advance:
        for frame in frames(points, candidates):
            crops = [
                surface.crop(Frame(frame.at + way, frame.axes))
                for surface, way in zip(surfaces, ways, strict=True)
            ]
            tried.append(crops)
            advance()
            left -= not any(crop.on_edge for crop in crops)
            if left == 0:
                break
    chosen = [crops for crops in tried if not any(crop.on_edge for crop in crops)]
    edges = len(tried) - len(chosen)
    if not chosen:
        chosen, edges = tried[:most], 0
    shapes = None if without_texture is None else Cropper(body, side_mm=skin.patch_mm)
    feels = []
    for number, (surface, way) in enumerate(zip(surfaces, ways, strict=True)):
        crops = [each[number] for each in chosen]
        alone = [
            over_torus(crop, surface) if shapes is None else over_object(crop, shapes, way) for crop in crops
        ]
        heights = np.stack(alone)
        values, fractions = pressed(heights, skin, model, crops[0].side_mm, thinned=True)
        regions = tuple(region_of(crop.frame.axes[2]) for crop in crops)
        bands = _bands_by_region(heights, crops[0].side_mm, regions, skin, model)
        curvature = ESTIMATED if shapes is None else TAKEN_OUT
        of_mesh = body, crops, values, fractions, edges, 0, points.area_mm2, curvature, values
        feels.append(BeadFeel(*of_mesh, regions, bands))
    return feels


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
    down, across = np.gradient(shape, crop.side_mm / len(shape))
    with np.errstate(invalid="ignore"):
        above = (crop.heights + crop.level_mm - shape) / np.sqrt(1.0 + down**2 + across**2)
    return _reached(above, crop)


def over_torus(crop: SurfaceCrop, surface: BeadSurface) -> Array:
    """Heights (n, n) mm of beads over the torus that lies nearest to them around a place.

    The torus is fitted on a disc that is wider than the patch, so that waves of the beads average out, or to
    the patch where the disc holds another surface. A patch that is flat but for its beads stays as it is.
    """
    at = (np.arange(COARSE) + 0.5) * (2.0 * WIDE_MM / COARSE) - WIDE_MM
    x, y = np.meshgrid(at, at[::-1])
    points = np.stack(
        [x, y, surface.heights(crop.frame, 2.0 * WIDE_MM, COARSE, 2.0 * HEIGHT_LIMIT_MM)], axis=2
    )
    points = points[np.abs(points[..., 2] - crop.level_mm - HEIGHT_LIMIT_MM) < HEIGHT_LIMIT_MM]
    on_patch = points[np.abs(points[:, :2]).max(axis=1) < 0.5 * PATCH_SIDE_MM]
    disc, patch = fitted(points[np.hypot(*points.T[:2]) < WIDE_MM]), fitted(on_patch)
    shape = better(disc, patch, on_patch, FARTHER)
    flat = on_patch * (1.0, 1.0, 0.0)
    plane = np.column_stack([flat[:, :2], np.ones(len(flat))])
    bent = torus(shape, *flat.T[:2])[0]
    if float((bent - plane @ np.linalg.lstsq(plane, bent)[0]).std()) < BENT_MM:
        return crop.heights
    at = ((np.arange(len(crop.heights)) + 0.5) / len(crop.heights) - 0.5) * crop.side_mm
    x, y = np.meshgrid(at, at[::-1])
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
