"""Feel of a mesh: roughness and contact area at places evenly over its surface."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Self

import numpy as np
import torch

import tactile
from optimize.verification.solids.over_object import over_object
from optimize.verification.solids.own_shape import textures_alone
from optimize.verification.solids.plates import plates_of
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM, MOST_MESH_PLACES, MOST_TRIED, PATCH_SIDE_MM
from relief.ground.progress import stage
from relief.places import SPACING_MM, cut, patch_shape, places
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.crops import EDGE_SHARE, Cropper, SurfaceCrop
from relief.solids.meshes.mesh_places import frames, spread, surface_points
from relief.solids.meshes.shells import outside
from relief.solids.meshes.unrolling import Unroller
from relief.solids.remeshing.smooth_surface import smooth_object
from tactile.jnd import jnd_unless_smooth
from tactile.measures import collected, each, measure_touch
from tactile.model import ModelName
from tactile.quantities import QUANTITIES, ROUGHNESS, means

PART, ESTIMATED, TAKEN_OUT = "part of the roughness", "estimated and taken out", "taken out"
UNDER = "under the texture; the strain under the bare object is taken out"
PLATE = "none: a plate, felt as its height map"
"""What becomes of the object's own curvature: of edges and planes it is a part; from curved patches it is
taken by their own smooth shapes, or by the object without texture, which may also lie under the texture. The
top of a plate has none."""
MOST_ON_PLATE = 1600
"""Most contact locations of a plate, 40 x 40; a larger one has them at a multiple of the usual distance."""
FARTHEST_OBJECT_MM = 2.0 * HEIGHT_LIMIT_MM
"""Largest distance of a textured mesh from its object without texture, mm."""


@dataclass(frozen=True)
class MeshFeel:
    """What fingers get from a mesh.

    Attributes:
        body: That was touched, mm.
        crops: Of the k places: none on an edge or flat, or all flat, or all on edges.
        values: (k,) of quantities by name, in their units.
        contact_fractions: (k,) share of the patch in contact.
        edges: Number of places left out because they lie on edges, or are not textured all over.
        flat: Number of places left out because nothing can be felt there.
        area_mm2: Of the surface without the side on the printer's bed.
        curvature: What became of the object's own curvature, in words.
        as_pressed: (k,) of quantities by name, with the object's own curvature; the values themselves where
            the object without texture took it out, and of beads.
    """

    body: Body
    crops: Sequence[SurfaceCrop]
    values: dict[str, Array]
    contact_fractions: Array
    edges: int
    flat: int
    area_mm2: float
    curvature: str
    as_pressed: dict[str, Array]

    @property
    def means(self) -> dict[str, float]:
        """Means of the values over the places."""
        return means(self.values)

    @property
    def contact_fraction(self) -> float:
        """Mean share of the patch in contact over the places."""
        return float(self.contact_fractions.mean())

    @property
    def ends(self) -> dict[str, float]:
        """The `count` of places, and the least, largest and standard deviation of each quantity."""
        ends: dict[str, float] = {"count": len(self.crops)}
        for name, values in self.values.items():
            ends |= {f"{name}_min": float(values.min()), f"{name}_max": float(values.max())}
            ends[f"{name}_std"] = float(values.std())
        return ends

    @property
    def sides_mm(self) -> list[float]:
        """Extent of the body along x, y and z."""
        sides: list[float] = np.ptp(self.body.vertices, axis=0).tolist()
        return sides

    def by_region(self) -> "dict[str, Self]":
        """The feel of each kind of surface of a sliced part; nothing of a mesh."""
        return {}

    def details(self, first: "MeshFeel | None" = None) -> dict[str, Any]:
        """Numbers of a mesh beside those of a texture: edges, curvature, sides, every touch.

        Args:
            first: Another solid, pressed at the same places, from which just-noticeable differences count.
        """
        roughness = self.values[ROUGHNESS.name]
        apart: list[dict[str, Any]] = [{} for _ in self.crops]
        if first is not None:
            pairs = zip(roughness.tolist(), first.values[ROUGHNESS.name].tolist(), strict=True)
            apart = [{"jnd_from_first": jnd_unless_smooth(*pair)} for pair in pairs]
        return {
            "on_edge": self.edges,
            "flat": self.flat,
            "all_on_edge": self.crops[0].on_edge,
            "curvature": self.curvature,
            "as_pressed": means(self.as_pressed),
            "surface_mm2": self.area_mm2,
            "sides_mm": self.sides_mm,
            "touches": [
                {
                    "at_mm": crop.frame.at.tolist(),
                    "axis": crop.frame.axes[2].tolist(),
                    **{name: float(values[number]) for name, values in self.values.items()},
                    "as_pressed": {name: float(each[number]) for name, each in self.as_pressed.items()},
                    **apart[number],
                }
                for number, crop in enumerate(self.crops)
            ],
        }


def feel_of(
    mesh: Mesh,
    skin: tactile.Skin,
    model: ModelName = "layer",
    most: int = MOST_MESH_PLACES,
    without_texture: Mesh | None = None,
    as_printed: Body | None = None,
    on_shape: bool = False,
) -> MeshFeel:
    """Press the skin on places 2.5 mm apart, or as many as there may be, all over a mesh.

    The finger presses along the outward axis of the surroundings of a place, on a patch of 10 mm a side. That
    of a round finger is wider, and the 10 mm in its middle show if the place is flat or on an edge. The
    side that lies on the printer's bed, flat and lowest, is left out. Where the patch reaches over an edge
    the finger meets the shape and not a texture: such places are left out too, as are planes, unless there
    are no others, as on the rim of a coin.

    Args:
        mesh: A solid.
        skin: The finger.
        model: Of touch.
        most: Most places that are pressed, but of a plate.
        without_texture: The object before its texture, at the same place. With it the finger presses on the
            heights of the texture over the unrolled object, so that the object's own curvature is no part of
            what is felt; places whose patch is not textured all over are left out. Without it the texture is
            also separated from the patch's own smooth shape, and its feel is what is headed by.
        as_printed: The surface that a printer makes of the mesh, which is pressed in the mesh's stead at the
            places of the mesh.
        on_shape: press on the texture where it lies, on the object without texture, and take out the strain
            under the bare object, as a texture is steered with `touch.curved_x_mm`.

    Raises:
        InputError: The object without texture is another one, or its faces are too large.
        ContactError: A contact does not converge.
    """
    cropped: Iterator[SurfaceCrop]
    body = mesh.body if as_printed is None else as_printed
    if without_texture is None and (of_plates := _plates_felt(mesh, skin, model, as_printed)) is not None:
        return of_plates
    if without_texture is None:
        points = surface_points(mesh.body)
        candidates = spread(points.at, MOST_TRIED)
        if mesh.folded:
            candidates = candidates[outside(points.at[candidates], points.normals[candidates], mesh.body)]
        cropper = Cropper(mesh.body, side_mm=skin.patch_mm)
        cropped = map(cropper.crop, frames(points, candidates))
        if as_printed is not None:
            # Steps of a print are meant: their triangles are no samples of a smooth surface.
            cropper = Cropper(as_printed, fine_mm=0.0, side_mm=skin.patch_mm)
            cropped = map(partial(_of_print, cropper=cropper), cropped)
        crops = _looked_at(cropped, len(candidates), most)
    else:
        unroller = _unroller(replace(mesh, body=body), without_texture)
        points = surface_points(unroller.object)
        near = points.at[spread(points.at, MOST_TRIED)]
        for whole in (True, False):
            cropped = (over_object(unroller, at, skin.patch_mm, whole) for at in near)
            crops = _looked_at(cropped, len(near), most)
            if not all(crop.on_edge for crop in crops):
                break
    on_edge, flat = ([one for one in crops if one.on_edge], [one for one in crops if one.flat])
    chosen = [one for one in crops if not (one.on_edge or one.flat)] or (flat or on_edge)[:most]
    heights = np.stack([crop.heights for crop in chosen])
    shapes = None
    if without_texture is not None and on_shape:
        bare = Cropper(without_texture.body, side_mm=skin.patch_mm)
        shapes = np.stack([bare.crop(one.frame).heights for one in chosen])
    values, fractions = pressed(heights, skin, model, chosen[0].side_mm, shapes)
    edges = 0 if chosen[0].on_edge else len(on_edge)
    plain = 0 if chosen[0].flat else len(flat)
    as_pressed, curvature = values, PART if without_texture is None else UNDER if on_shape else TAKEN_OUT
    if without_texture is None and not (chosen[0].on_edge or chosen[0].flat):
        alone, curvature = textures_alone(chosen, cropper.around), ESTIMATED
        if alone:
            found, shares = pressed(np.stack([*alone.values()]), skin, model, chosen[0].side_mm)
            numbers = list(alone)
            values = {name: _replaced(values[name], numbers, found[name]) for name in values}
            fractions = _replaced(fractions, numbers, shares)
    return MeshFeel(body, chosen, values, fractions, edges, plain, points.area_mm2, curvature, as_pressed)


def _plates_felt(
    mesh: Mesh, skin: tactile.Skin, model: ModelName, as_printed: Body | None
) -> MeshFeel | None:
    """What fingers get from plates as their height maps; None of other solids. Raises ContactError."""
    crops: list[SurfaceCrop] = []
    touches, left_out = [], 0
    for plate in plates_of(mesh.body, str(mesh.path), as_printed):
        surface, spacing = plate.relief.surface, SPACING_MM
        shape = patch_shape(surface)
        while len(at := places(surface, spacing)) > MOST_ON_PLATE:
            spacing *= 2.0
        kept = at[cut(plate.bare, at, shape).mean(axis=(1, 2)) <= EDGE_SHARE]
        if not len(kept):
            return None
        try:
            touches.append(measure_touch(plate.relief, skin, model, at=kept))
        except InputError:
            # Too small for a patch, or so deep that fingers reach through its floor.
            return None
        side_mm = min(PATCH_SIDE_MM, *surface.size_mm)
        for frame, (row, col) in zip(plate.frames(kept), kept, strict=True):
            under = plate.relief.heights[row : row + shape[0], col : col + shape[1]]
            crops.append(SurfaceCrop(frame, under, False, side_mm))
        left_out += len(at) - len(kept)
    if not crops:
        return None
    values = {name: np.concatenate([touch.values[name] for touch in touches]) for name in QUANTITIES}
    fractions = np.concatenate([touch.contact_fractions for touch in touches])
    area = surface_points(mesh.body).area_mm2
    body = mesh.body if as_printed is None else as_printed
    return MeshFeel(body, crops, values, fractions, left_out, 0, area, PLATE, values)


def _of_print(crop: SurfaceCrop, cropper: Cropper) -> SurfaceCrop:
    """What the print has at a place of the mesh; edges and planes are those of the mesh."""
    if crop.on_edge or crop.flat:
        return crop
    return replace(cropper.crop(crop.frame), on_edge=False)


def _replaced(values: Array, numbers: Sequence[int], others: Array) -> Array:
    """(k,) values with others in the place of some."""
    replaced = values.copy()
    replaced[numbers] = others
    return replaced


def _unroller(mesh: Mesh, without_texture: Mesh) -> Unroller:
    """The unroller of a mesh. Raises InputError if the object without texture does not fit."""
    unroller = Unroller(mesh.body, smooth_object(without_texture.body, without_texture.path))
    if unroller.farthest_mm > FARTHEST_OBJECT_MM:
        raise InputError(
            f"{without_texture.path}: lies up to {unroller.farthest_mm:.3g} mm from {mesh.path.name}; "
            "the object without texture must lie where the textured one does"
        )
    return unroller


def _looked_at(cropped: Iterator[SurfaceCrop], count: int, most: int) -> list[SurfaceCrop]:
    """Crops until as many as are wanted are neither on edges nor flat."""
    crops: list[SurfaceCrop] = []
    left = most
    with stage("looking at places", count) as advance:
        for crop in cropped:
            crops.append(crop)
            advance()
            left -= not (crop.on_edge or crop.flat)
            if left == 0:
                break
    return crops


def pressed(
    heights: Array,
    skin: tactile.Skin,
    model: ModelName,
    size_mm: float = PATCH_SIDE_MM,
    shapes: Array | None = None,
    thinned: bool = False,
) -> tuple[dict[str, Array], Array]:
    """Values (k,) of quantities and share (k,) in contact of patches (k, n, n) mm of a side.

    With shapes (k, n, n) mm the patches lie on them, and the strain under the bare shapes is taken out. A
    thinned sum for roughness is within 0.02 % of the full one, and as fast on fine grids as on coarse ones.
    """

    def press(part: slice) -> tuple[tactile.Touch, dict[str, Array]]:
        fields = torch.as_tensor(heights[part])
        under = None if shapes is None else torch.as_tensor(shapes[part])
        touch = tactile.press(fields if under is None else fields + under, size_mm, skin, model)
        if under is not None:
            bare = tactile.press(under, size_mm, skin, model)
            touch = replace(touch, strain=touch.strain - bare.strain)
        advance(len(fields))
        values = {name: (thinned and one.step_value) or one.value for name, one in QUANTITIES.items()}
        return touch, {name: each(value(touch)) for name, value in values.items()}

    with stage("pressing on places", len(heights)) as advance:
        touch = collected(len(heights), heights.shape[-1], press, model)
    return touch.values, touch.contact_fractions
