"""A part of a body's surface that is remeshed: its triangles, where they lie on the smooth surface, and the
lines and corners of the part that stay.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from relief.ground.arrays import Array, Flags, Index, flagged
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import edge_pairs
from relief.solids.remeshing.smooth_surface import SmoothSurface, corner_groups, raised


@dataclass(frozen=True)
class Patch:
    """Triangles to be remeshed, each within a facet of a smooth surface.

    Attributes:
        surface: The smooth surface.
        body: The triangles; the vertices on the border come first.
        facet: (faces,) facet of the surface that each triangle lies in.
        corners: (faces, 3, 3) barycentric coordinates of the corners in their facets.
        rise: (vertices,) part of the way from the facets to the smooth surface that vertices go, 0 to 1; 0 on
            the border.
        border: Number of vertices that are shared with triangles outside of the patch, and stay.
        taken: Sorted keys of the edges between such vertices outside of the patch, which the patch may not
            have more than once.
        uv: (facets, 3, 2) texture coordinates, or None.
    """

    surface: SmoothSurface
    body: Body
    facet: Index
    corners: Array
    rise: Array
    border: int
    taken: Index
    uv: Array | None = None

    @cached_property
    def normals(self) -> Array:
        """(faces, 3, 3) unit normals of the surface at the corners."""
        facet = np.repeat(self.facet, 3)
        return self.surface.normals_at(facet, self.corners.reshape(-1, 3)).reshape(-1, 3, 3)

    @cached_property
    def creases(self) -> Flags:
        """(faces, 3) whether the edge from corner k to corner k + 1 lies on an edge of the part."""
        # On the edge from corner k to k + 1 of a facet the coordinate of the third corner is 0.
        beyond = np.roll(self.corners == 0.0, 1, axis=2)
        on_edge = beyond & np.roll(beyond, -1, axis=1)
        return np.asarray((on_edge & self.surface.creases[self.facet][:, None]).any(axis=2))

    def located(self, face: Index, share: Array) -> tuple[Index, Array]:
        """Facets (n,) and barycentric coordinates (n, 3) there of points given by those in the triangles."""
        return self.facet[face], np.einsum("nc,ncd->nd", share, self.corners[face])

    def lift(self, face: Index, share: Array) -> Array:
        """Ways (n, 3) that points go from the facets towards the smooth surface, mm."""
        rise = (share * self.rise[self.body.faces[face]]).sum(axis=1, keepdims=True)
        return np.asarray(rise * raised(self.surface.bulges, *self.located(face, share)))

    def missed(self, face: Index, share: Array, way: Array) -> Array:
        """Distances (n,) of points at ways (n, 3) from the facets, mm: to the exact surface or the facets."""
        facet, flat = self.located(face, share)
        exact = self.surface.exact[facet][:, None] * raised(self.surface.bulges, facet, flat)
        return np.asarray(np.linalg.norm(way - exact, axis=1))


def held_lines(patch: Patch) -> tuple[Flags, Flags]:
    """(faces, 3) edges of a patch that stay, and (vertices,) vertices that stay."""
    body = patch.body
    faces = body.faces
    pairs = edge_pairs(faces)
    held = patch.creases.ravel().copy()
    if patch.uv is not None:
        flat = np.einsum("fkc,fcd->fkd", patch.corners, patch.uv[patch.facet])
        flat, ahead = flat.reshape(-1, 2), np.roll(flat, -1, axis=1).reshape(-1, 2)
        one, other = pairs.T
        seam = ~np.isclose(flat[one], ahead[other]).all(axis=1)
        seam |= ~np.isclose(ahead[one], flat[other]).all(axis=1)
        held[pairs[seam].ravel()] = True
    # Edges of more than two faces, and vertices where several fans meet.
    single = ~flagged(pairs, len(held))
    held |= single
    one, other = pairs.T
    fan = corner_groups(body, pairs, np.zeros(faces.shape, bool))
    fans = np.unique(np.stack([faces.ravel(), fan]), axis=1)[0]
    corner = np.bincount(fans, minlength=len(body.vertices)) > 1
    half = np.flatnonzero(single)
    corner[faces.ravel()[half]] = corner[np.roll(faces, -1, axis=1).ravel()[half]] = True
    return held.reshape(-1, 3), corner
