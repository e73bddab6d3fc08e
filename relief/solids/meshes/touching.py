"""Surfaces of parts of a body that lie on one another."""

from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array, units
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.intersections import near_parts
from relief.solids.meshes.neighbourhood import points_along
from relief.solids.meshes.refining import refined
from relief.solids.meshes.shells import components, windings

TOUCH_MM = 1.0
"""Longest edge of the triangles by which touching surfaces are found, mm."""
TOUCHING_MM = 1e-3
"""Distance up to which faces touch, mm: the least depth of an intersection."""
NEAR_MIDDLE = np.array([0.37, 0.34, 0.29])
"""Barycentric coordinates of the tested point of a triangle: middles often lie in planes of drawings."""
MOST_TOUCHING = 100_000
"""Triangles, about, that are compared with other parts; more area takes larger ones."""


@dataclass(frozen=True)
class Touching:
    """Where parts of a body touch.

    Attributes:
        edges: (n, 3) points of edges along which parts meet, `TOUCH_MM` apart at most, mm.
        faces: (n, 3) points of faces that lie on those of other parts, mm.
        reach_mm: Distance from `faces` within which all such places lie, mm.
        area_mm2: Their area.
    """

    edges: Array
    faces: Array
    reach_mm: float
    area_mm2: float


@stage("looking for touching parts")
def touching(body: Body, wedges: Array) -> Touching:
    """Where parts of a body touch.

    Args:
        body: Closed, and `separated`, so that parts that touch share no vertex.
        wedges: (n, 2, 3) ends of the edges along which parts meet, mm.
    """
    edges = points_along(wedges, TOUCH_MM)
    part = np.unique(components(body), return_inverse=True)[1]
    near = near_parts(body, part, TOUCHING_MM) if part.any() else np.zeros(0, np.int64)
    if not len(near):
        return Touching(edges, np.zeros((0, 3)), TOUCH_MM, 0.0)
    alone = Body(body.vertices, body.faces[near])
    spacing = max(TOUCH_MM, float(np.sqrt(2.0 * alone.areas.sum() / MOST_TOUCHING)))
    pieces = refined(alone, spacing)
    beside = near_parts(pieces.body, part[near[pieces.parent]], TOUCHING_MM)
    fine = Body(pieces.body.vertices, pieces.body.faces[beside])
    middles = np.einsum("c,fcd->fd", NEAR_MIDDLE, fine.vertices[fine.faces])
    normals = units(fine.normals)
    covered = np.flatnonzero(windings(middles, normals, body, TOUCHING_MM) > 0.0)
    # Behind a face that only touches another part lies nothing of that part.
    covered = covered[windings(middles[covered], -normals[covered], body, TOUCHING_MM) == 1.0]
    places = fine.vertices[np.unique(fine.faces[covered])]
    return Touching(edges, places, spacing, float(fine.areas[covered].sum()))
