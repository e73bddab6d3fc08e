"""Projection of vertices onto the smooth surface, unless triangles would then intersect.

The smooth surfaces of a thin wall may intersect where its facets do not, for example between a ball and a
bore that nearly touches it.
"""

import numpy as np

from relief.ground.arrays import Array, Flags, Index, sums_by
from relief.solids.body import Body
from relief.solids.meshes.intersections import crossing_faces
from relief.solids.meshes.neighbourhood import edge_ends

LEAST_EDGE_MM, PARTED = 1e-3, 0.02
"""Length of an edge, mm, below which its ends are one point, and part of the way to the middle of its
neighbours by which such a vertex moves: some um."""
ROUNDS = 4
"""Most rounds in which vertices return to their facets: each round may leave new intersections beside
them."""


def lifted(vertices: Array, onto: Array, faces: Index, free: Flags) -> tuple[Array, Flags]:
    """Vertices (n, 3) on the smooth surface, and whether they stayed on the facets (n,).

    Args:
        vertices: On the facets, mm.
        onto: The same on the smooth surface, mm.
        faces: (m, 3) of a closed mesh.
        free: (n,) vertices on no held line; others stay.
    """
    stayed = np.zeros(len(vertices), bool)
    for number in range(ROUNDS + 1):
        moved = np.where(stayed[:, None], vertices, onto)
        _part(moved, faces, free)
        crossing = faces[crossing_faces(Body(moved, faces))]
        if number == ROUNDS or stayed[crossing].all():
            break
        stayed[crossing] = True
    return moved, stayed


def _part(vertices: Array, faces: Index, free: Flags) -> None:
    """Move vertices (n, 3) apart that have come to lie on their neighbours: no triangle may be a point.

    Args:
        vertices: mm; changed in place.
        faces: (m, 3) of a closed mesh.
        free: (n,) vertices on no held line; others stay.
    """
    one, other = edge_ends(faces)
    short = np.linalg.norm(vertices[one] - vertices[other], axis=1) < LEAST_EDGE_MM
    moving = np.unique(np.where(free[one[short]], one[short], other[short]))
    moving = moving[free[moving]]
    if len(moving):
        count = np.bincount(one, minlength=len(vertices))[moving, None]
        sums = sums_by(one, vertices[other], len(vertices))
        vertices[moving] += PARTED * (sums[moving] / count - vertices[moving])
