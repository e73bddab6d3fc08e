"""Where a relief is lowered because the object bends too tightly or is too thin."""

from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array, Flags, Index
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs

LOWERED = 0.99
"""Factor of the heights below which a relief counts as lowered."""
MOST_PLACES = 10
"""Most places that are reported, the largest first."""
LEAST_MM2 = 0.5
"""Least area of a place that is reported, mm²: a hundredth of a fingertip's contact."""


class LoweredPlace(NamedTuple):
    """A connected piece of the surface on which the relief is lowered.

    Attributes:
        at_mm: middle of the triangle with the lowest factor, mm.
        area_mm2: of the piece.
        lowest_factor: least factor of the heights there.
    """

    at_mm: tuple[float, float, float]
    area_mm2: float
    lowest_factor: float


class Lowering(NamedTuple):
    """Area, factors and places of a lowered relief.

    Attributes:
        part: of the textured area, from 0 to 1.
        median_factor: of the heights over that part, by area; 1 without any.
        lowest_factor: the least factor of the heights; 1 without any.
        places: pieces of `LEAST_MM2` and more, the largest first, `MOST_PLACES` at most.
    """

    part: float
    median_factor: float
    lowest_factor: float
    places: tuple[LoweredPlace, ...]


def lowering(body: Body, where: Flags, factor: Array) -> Lowering:
    """Sum up the factors of a relief's heights.

    Args:
        body: the surface.
        where: (faces,) triangles that carry texture.
        factor: (vertices,) factors of the heights, 0 to 1.
    """
    faces = np.flatnonzero(where)
    least = factor[body.faces[faces]].min(axis=1)
    low = least < LOWERED
    if not low.any():
        return Lowering(0.0, 1.0, 1.0, ())
    faces, least = faces[low], least[low]
    areas = body.areas[faces]
    order = np.argsort(least)
    middle = np.searchsorted(np.cumsum(areas[order]), 0.5 * areas.sum())
    return Lowering(
        part=float(areas.sum() / body.areas[where].sum()),
        median_factor=float(least[order[min(middle, len(order) - 1)]]),
        lowest_factor=float(least.min()),
        places=_places(body, faces, least, areas),
    )


def _places(body: Body, faces: Index, least: Array, areas: Array) -> tuple[LoweredPlace, ...]:
    """The connected pieces of lowered triangles, with their least factors and their areas (faces,)."""
    piece = connected(edge_pairs(body.faces[faces]) // 3, len(faces))
    total = np.bincount(piece, areas)
    places = []
    for number in np.argsort(-total)[:MOST_PLACES]:
        if total[number] < LEAST_MM2:
            break
        own = np.flatnonzero(piece == number)
        lowest = own[np.argmin(least[own])]
        x, y, z = body.vertices[body.faces[faces[lowest]]].mean(axis=0).tolist()
        places.append(LoweredPlace((x, y, z), float(total[number]), float(least[lowest])))
    return tuple(places)
