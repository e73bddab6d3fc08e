"""Displacement of vertices along their normals by a relief, which is lowered where triangles intersect.

Intersections shallower than any printer shows count as well, since other programs report them.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from relief.ground.arrays import Array, Flags, Index, flagged
from relief.ground.progress import say
from relief.solids.body import Body
from relief.solids.meshes.intersections import crossing_faces
from relief.solids.wrapping.bare_places import PlaceError
from relief.solids.wrapping.clearance import evened
from relief.solids.wrapping.surfaces import FineSurface

MENDINGS = 6
"""Most rounds in which the relief is lowered where triangles intersect; two are usual."""
MENDED = 0.5
"""Factor of the heights there, in each round."""
LEAST_FACTOR = 0.05
"""Factor below which heights are set to 0, which leaves no intersection."""


def displaced(
    surface: FineSurface, offset: Array, factor: Array, written: Callable[[Body], Body]
) -> tuple[Body, Array]:
    """The body with the patch moved, and the factors, lowered where its triangles pass through others.

    Args:
        surface: The fine body.
        offset: (fine vertices,) displacements, mm.
        factor: (base vertices,) by which they are lowered where there is too little room.
        written: Gives a body with the coordinates that the file will hold.

    Raises:
        InputError: Triangles pass through one another however low the relief is.
    """
    before, changed = surface.points.places, np.ones(len(surface.fine.body.faces), bool)
    rest = replace(surface.rest, vertices=written(Body(surface.rest.vertices, surface.rest.faces)).vertices)
    tight = np.zeros(len(factor), bool)
    for left in reversed(range(MENDINGS)):
        body, moved = surface.fine.body, offset * surface.of_vertices(factor)
        places = body.vertices + moved[:, None] * surface.normals
        places[:, 2] = np.maximum(places[:, 2], surface.base.file.bed_mm)
        own = written(Body(places, body.faces))
        wrapped = rest.joined(own)
        # Triangles that were not lowered since the last search do not intersect each other.
        changed |= (own.vertices != before).any(axis=1)[body.faces].any(axis=1)
        crossing = _crossing(surface, wrapped, changed, shallow=True)
        if not left or not len(crossing):
            break
        at = flagged(surface.base.body.faces[surface.fine.parent[crossing]], len(factor))
        away = (moved != 0.0)[body.faces[crossing]].any()
        # Remaining intersections may be those of the smooth surface between vertices of the base.
        if not surface.flatten(at & (tight | (not away))) and not away:
            break
        before, changed, tight = own.vertices, flagged(crossing, len(body.faces)), tight | at
        lower = np.where(at, MENDED * factor, factor)
        lower[lower < LEAST_FACTOR] = 0.0
        factor = evened(surface.base.body, lower, surface.base.file.settings.falloff_mm)
        say(f"{len(crossing):,} triangles pass through others; the relief is lowered there")
    # The object's own surface may have intersections that no printer shows.
    if len(crossing) and len(left_over := _crossing(surface, wrapped, changed)):
        middles = wrapped.vertices[wrapped.faces[left_over]].mean(axis=1)
        place = ", ".join(f"{value:.1f}" for value in middles[0])
        raise PlaceError(
            "relief",
            f"{len(left_over):,} triangles pass through others around ({place}) mm, "
            "however low the relief is",
            "leave that place out (--mask), take smaller triangles (--faces) or a lower relief (--relief-mm)",
            middles,
        )
    return wrapped, factor


def _crossing(surface: FineSurface, wrapped: Body, changed: Flags, shallow: bool = False) -> Index:
    """Numbers of the patch's triangles with texture, among changed ones, that pass through any others."""
    if surface.base.file.settings.draft:
        return np.zeros(0, np.intp)
    of = np.zeros(len(wrapped.faces), bool)
    of[: len(changed)] = changed & surface.base.textured[surface.fine.parent]
    return crossing_faces(wrapped, shallow, of)
