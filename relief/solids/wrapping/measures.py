"""Measures of a wrapping: how the object bends along the axes of its texture, where the relief is lowered
because the object bends too tightly or is too thin, and how much of the relief there is.
"""

from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array, Flags, Index, quantiles
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs
from relief.solids.wrapping.coordinates.layout import Layout

STRAIGHT_MM = 200.0
"""Least radius of a surface that counts as straight, mm: over a patch of 10 mm such a surface rises by 0.06
mm."""
LEAST_MM = 3.0
"""Least radius that is reported, mm: the least that models of touch take."""
HALF = (0.25, 0.75)
"""Lower and upper quartile, as shares of the area."""
DEGENERATE = 1e-9
"""Area in the texture, mm², below which a triangle has no directions there."""
LOWERED = 0.99
"""Factor of the heights below which a relief counts as lowered."""
MOST_PLACES = 10
"""Most places that are reported, the largest first."""
LEAST_MM2 = 0.5
"""Least area of a place that is reported, mm²: a hundredth of a fingertip's contact."""
WHOLE = 0.99
"""Share of the relief from which it counts as whole."""


class Bending(NamedTuple):
    """Curvatures of the textured surface along an axis of the texture, 1/mm; positive where it bulges.

    Attributes:
        median: over the textured area.
        low: lower quartile.
        high: upper quartile.
    """

    median: float
    low: float
    high: float

    @property
    def radius_mm(self) -> float | None:
        """Radius of the median, mm, negative in a hollow; None where the surface is straight."""
        if abs(self.median) <= 1.0 / STRAIGHT_MM:
            return None
        return float(np.copysign(max(LEAST_MM, abs(1.0 / self.median)), self.median))


def bending(body: Body, normals: Array, layout: Layout, where: Flags) -> tuple[Bending, Bending]:
    """Curvatures along x, to the texture's right, and along y, to its top.

    Args:
        body: the surface.
        normals: (faces, 3, 3) unit normals at the corners.
        layout: coordinates of the texture; those of a triangle's leading patch count.
        where: (faces,) triangles that carry texture.
    """
    faces = np.flatnonzero(where & layout.laid())
    uv = layout.uv[faces, layout.leading()[faces]]
    corners, normals = body.vertices[body.faces[faces]], normals[faces]
    edges = (uv[:, 1:] - uv[:, :1]).transpose(0, 2, 1)
    determinant = np.linalg.det(edges)
    sound = np.abs(determinant) > DEGENERATE
    inverse = np.linalg.inv(edges[sound])
    # Derivatives of the place and of the normal by the coordinates, (faces, 3, 2).
    place, turn = (
        (values[sound, 1:] - values[sound, :1]).transpose(0, 2, 1) @ inverse for values in (corners, normals)
    )
    curvature = (place * turn).sum(axis=1) / np.maximum((place**2).sum(axis=1), DEGENERATE)
    areas = body.areas[faces][sound]
    one, other = (_over_area(curvature[:, axis], areas) for axis in range(2))
    return one, other


def _over_area(values: Array, areas: Array) -> Bending:
    """Median and quartiles of values (n,), weighted by areas (n,)."""
    if not len(values):
        return Bending(0.0, 0.0, 0.0)
    return Bending(*quantiles(values, areas, [0.5, *HALF]).tolist())


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


class Presence(NamedTuple):
    """How much of the relief is there.

    Attributes:
        whole_mm2: Area with the whole relief.
        largest: Largest share of the relief anywhere, 0 to 1.
    """

    whole_mm2: float
    largest: float


def presence(body: Body, share: Array) -> Presence:
    """Sum up shares (vertices,) of the relief, 0 to 1, over the triangles of a body."""
    whole = share[body.faces].mean(axis=1) >= WHOLE
    return Presence(float(body.areas[whole].sum()), float(share.max()))


def narrower(largest: float, falloff_mm: float) -> float:
    """The falloff, mm, with which a relief whose largest share is below 1 becomes whole at that place."""
    steps = np.linspace(0.0, 1.0, 1001)
    place = steps[np.searchsorted(steps**2 * (3.0 - 2.0 * steps), largest)]
    return float(place * falloff_mm)
