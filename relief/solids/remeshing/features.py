"""Lines and corners of a part that stay where they are, and the regions of its surface between them."""

import numpy as np

from relief.ground.arrays import Flags, Index
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs
from relief.solids.remeshing.patch import Patch
from relief.solids.remeshing.smooth_surface import corner_groups


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
    single = np.ones(len(held), bool)
    single[pairs] = False
    held |= single
    one, other = pairs.T
    fan = corner_groups(body, pairs, np.zeros(faces.shape, bool))
    fans = np.unique(np.stack([faces.ravel(), fan]), axis=1)[0]
    corner = np.bincount(fans, minlength=len(body.vertices)) > 1
    half = np.flatnonzero(single)
    corner[faces.ravel()[half]] = corner[np.roll(faces, -1, axis=1).ravel()[half]] = True
    return held.reshape(-1, 3), corner


def regions(body: Body, held: Flags) -> Index:
    """(faces,) numbers of the parts of the surface between held edges."""
    pairs = edge_pairs(body.faces)
    return connected(pairs[~held.ravel()[pairs[:, 0]]] // 3, len(body.faces))
