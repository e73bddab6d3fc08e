"""Patches of a texture over its object without texture, unrolled, and whether it is there all over them."""

from dataclasses import replace

import numpy as np

from relief.ground.arrays import Array
from relief.ground.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.solids.meshes.crops import Cropper, SurfaceCrop
from relief.solids.meshes.mesh_places import Frame
from relief.solids.meshes.unrolling import TEXTURED_MM, Unroller

GROWTH_MM = 2.0
"""Width beside a patch, mm, in which the object must not be bare: as wide as a texture grows by default."""
MAP_ERROR_MM = 0.5
"""Error of ways on an unrolled surface, mm, that is allowed for where edges alone decide."""
LEAST_WAY = 0.8
"""Least way over an unrolled surface, in that of the straight one, that is no error of the map."""
RIM_MM = 1.875
"""Width of the strips along the sides of a patch that have to be textured."""
LEAST_TEXTURE = 0.4
"""Height of a texture in half a strip, in units of that in its patch, from which it counts as textured.
The least over places on the tiles that come with Retouch is 0.49 (terrain); without texture it is 0."""


def over_object(unroller: Unroller, near: Array, side_mm: float | None, whole: bool) -> SurfaceCrop:
    """The crop of the texture over the unrolled object near a point (3,) mm.

    One that is not textured all over counts as on an edge, and, where `whole` is asked for, one beside which
    the texture ends, or that has a sharp edge.
    """
    vertex, frame = unroller.frame(near)
    # What is left out is not cropped, and most of it not unrolled: four places of five on a dial with texture
    # around its side.
    left_out = SurfaceCrop(frame, np.zeros((1, 1)), True)
    if whole and near_end(unroller, vertex):
        return left_out
    places = unroller.flat(vertex, frame)
    if whole and ends(unroller, places, frame.at):
        return left_out
    flat = unroller.unrolled(places)
    if not len(flat.faces):
        # All around lie bare triangles that are wider than the patch.
        return left_out
    crop = Cropper(flat, side_mm=side_mm).crop(Frame(np.zeros(3), np.eye(3)))
    inside = (np.abs(flat.vertices[:, :2]) < 0.5 * PATCH_SIDE_MM).all(axis=1)
    # The highest point of a crop is at the limit.
    over = crop.middle - HEIGHT_LIMIT_MM + flat.vertices[inside, 2].max(initial=0.0)
    return replace(crop, frame=frame, on_edge=crop.on_edge or not textured(over))


def near_end(unroller: Unroller, vertex: int) -> bool:
    """Whether `ends` holds around a vertex of the object for sure, as ways along edges are no shorter."""
    half = 0.5 * PATCH_SIDE_MM - MAP_ERROR_MM
    bare, sharp = unroller.to_bare[vertex], unroller.to_sharp[vertex]
    return bool(bare < half + GROWTH_MM or sharp < half)


def ends(unroller: Unroller, places: Array, at: Array) -> bool:
    """Whether the object is bare on a patch or up to 2 mm beside it, or has a sharp edge on the patch.

    Args:
        unroller: With the object.
        places: (vertices, 2) mm, as `Unroller.flat` gives them.
        at: (3,) the place, mm.
    """
    away = np.abs(places).max(axis=1) - 0.5 * PATCH_SIDE_MM
    # No way over the surface is shorter than the straight one: behind a rim the map has errors.
    straight = np.linalg.norm(unroller.object.vertices - at, axis=1)
    away[np.linalg.norm(places, axis=1) < LEAST_WAY * straight] = np.inf
    return bool((away[unroller.bare] < GROWTH_MM).any() or (away[unroller.sharp] < 0.0).any())


def textured(over: Array) -> bool:
    """Whether a texture covers a patch: heights (n, n) mm over the object, 10 mm a side.

    Where it ends, or has not yet grown to 0.4 of its height along a side, the finger feels a step. A height
    is the 95th percentile of distances from the object, as a texture may be cut into it.
    """
    away = np.abs(over)
    height, width = np.percentile(away, 95.0), round(RIM_MM / PATCH_SIDE_MM * len(away))
    strips = [strip for sides in (away, away.T) for strip in (sides[:width], sides[-width:])]
    halves = [half for strip in strips for half in np.array_split(strip, 2, axis=1)]
    least = min(float(np.percentile(half, 95.0)) for half in halves)
    return bool(height > TEXTURED_MM and least > LEAST_TEXTURE * height)
