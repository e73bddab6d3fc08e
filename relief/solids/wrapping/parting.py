"""The triangles of a file that carry texture, parted from those that stay as they were read.

A triangle is touched where the share of the relief is above 0 on it; its part with a share above 0 becomes a
patch to be remeshed. What is left of touched triangles, and triangles that share an edge with them, are
divided in their own planes, as far as the patch needs it. All others are bare and stay.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, Index, flagged, smooth_step
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import among, edge_ends, edge_keys, ways_from
from relief.solids.meshes.refining import Refined, refined
from relief.solids.remeshing.patch import Patch
from relief.solids.remeshing.smooth_surface import smooth_surface
from relief.solids.wrapping.file_surface import LEAST_SHARE, FileSurface, Near, points_between

RINGS = 4
"""Rings of triangles around the touched ones that decide on the smooth surface there, as many as
`relief.solids.remeshing.creases.BESIDE`."""
RISE = 0.5
"""Width over which a patch rises from the facets to the smooth surface, in the falloff: where the relief is
whole it stands on the smooth surface."""
LEVELS = 14
"""Halvings of the longest edges that are tried: of edges of 10 m to 1 mm."""


@dataclass(frozen=True)
class Rest:
    """What is left of a body beside a patch, whose border both share.

    Attributes:
        vertices: (n, 3) those that the patch lacks, mm.
        faces: (m, 3) numbers of vertices: first come those of the border, then `vertices`.
        border: Number of vertices on the border.
        parent: (m,) the triangle of the file that each face lies in.
    """

    vertices: Array
    faces: Index
    border: int
    parent: Index

    def after(self, count: int) -> Index:
        """Faces (m, 3) with `vertices` counted from `count`, after those of a patch."""
        return np.where(self.faces < self.border, self.faces, self.faces + (count - self.border))

    def joined(self, patch: Body) -> Body:
        """A patch, with the border first, and the rest as one body."""
        faces = np.concatenate([patch.faces, self.after(len(patch.vertices))])
        return Body(np.concatenate([patch.vertices, self.vertices]), faces)

    @property
    def edges(self) -> Index:
        """(k,) sorted keys of the edges between vertices of the border."""
        one, other = edge_ends(self.faces)
        shared = (one < self.border) & (other < self.border)
        return np.unique(edge_keys(one[shared], other[shared]))

    def divided(self, body: Body, edge_mm: float, where: Flags) -> tuple[Refined, "Rest"]:
        """A patch with finer triangles, and the rest, which is divided along the border in its own planes.

        Args:
            body: The patch.
            edge_mm: Longest edge of its triangles, mm.
            where: (faces,) triangles of the patch that need it.
        """
        keys = edge_keys(*edge_ends(self.faces))
        shared = edge_keys(*edge_ends(body.faces))
        shared = np.unique(shared[among(shared, self.edges)])
        beside = among(keys, shared).reshape(-1, 3).any(axis=1)
        whole = Rest(self.vertices, self.faces[beside], self.border, self.parent[beside]).joined(body)
        needed = np.concatenate([where, np.zeros(int(beside.sum()), bool)])
        fine = refined(whole, edge_mm, needed)
        # New vertices all lie in the patch or on its border, and come before those of the rest.
        count, end = len(body.vertices), len(whole.vertices)
        new = len(fine.body.vertices) - end
        number = np.arange(len(fine.body.vertices))
        number[count:end] += new
        number[end:] -= end - count
        faces, own = number[fine.body.faces], fine.parent < len(body.faces)
        vertices = np.concatenate([fine.body.vertices[:count], fine.body.vertices[end:]])
        far = Rest(self.vertices, self.faces[~beside], self.border, self.parent).after(count + new)
        parent = self.parent[beside][fine.parent[~own] - len(body.faces)]
        parent = np.concatenate([self.parent[~beside], parent])
        rest = Rest(self.vertices, np.concatenate([far, faces[~own]]), count + new, parent)
        return Refined(Body(vertices, faces[own]), fine.parent[own], fine.corners[own]), rest


@dataclass(frozen=True)
class Parting:
    """A body parted into a patch and the rest.

    Attributes:
        patch: What is remeshed.
        rest: Bare triangles of the file, and parts of others in their planes.
        facets: (k,) triangles of the file that are the facets of the patch's smooth surface.
        touched: (faces,) triangles of the file that carry texture somewhere.
    """

    patch: Patch
    rest: Rest
    facets: Index
    touched: Flags


def parted(surface: FileSurface, near: Near | None = None) -> Parting:
    """Part the body of a file by the share of the relief.

    Args:
        surface: The surface of the file.
        near: Where a texture may be that is placed once; None: everywhere.

    Raises:
        InputError: No place carries any relief.
    """
    body, settings = surface.body, surface.settings
    samples = surface.samples
    carries = samples.share > LEAST_SHARE
    if near is not None:
        carries[carries] = near(samples.points.at(np.flatnonzero(carries)))
    if not carries.any():
        mask = "" if settings.mask is None else f" {settings.mask}:"
        fault = f"mask:{mask} leaves nothing of the surface to the texture"
        raise InputError(f"{fault}; take a wider mask or a smaller falloff")
    touched = flagged(samples.face[carries], len(body.faces))
    keys = edge_keys(*edge_ends(body.faces)).reshape(-1, 3)
    local = np.flatnonzero(among(keys, np.unique(keys[touched])).any(axis=1))
    fine, parent, corners = _divided(surface, local, touched, carries)
    inside = touched[parent]
    rows = np.flatnonzero(inside)
    points = surface.points(np.repeat(parent[rows], 3), corners[rows].reshape(-1, 3))
    shared = surface.share_at(points) > LEAST_SHARE
    if near is not None:
        shared &= near(points)
    inside[rows] = shared.reshape(-1, 3).any(axis=1)
    rest = np.concatenate([np.delete(body.faces, local, axis=0), fine.faces[~inside]])
    bare = np.concatenate([np.delete(np.arange(len(body.faces)), local), parent[~inside]])
    own, other = _apart(fine.vertices, fine.faces[inside], rest, bare)
    facets = _around(body.faces, touched, len(body.vertices))
    return Parting(
        _patch(surface, own, other, parent[inside], corners[inside], facets), other, facets, touched
    )


def _divided(surface: FileSurface, local: Index, touched: Flags, carries: Flags) -> tuple[Body, Index, Array]:
    """Triangles of the file, (k,) numbers, divided along the border of what carries texture.

    Args:
        surface: The surface of the file.
        local: Triangles that carry texture or share an edge with such.
        touched: (faces,) those that carry texture.
        carries: (n,) samples of the surface that do.

    Returns:
        The finer body with all vertices of the file first, the file's triangle that each lies in, (m,), and
        barycentric coordinates of the corners there, (m, 3, 3).
    """
    body, samples = surface.body, surface.samples
    fine, parent = Body(body.vertices, body.faces[local]), local
    corners = np.broadcast_to(np.eye(3), (len(local), 3, 3))
    without = samples.points.places[touched[samples.face] & ~carries]
    outside = np.concatenate([without, points_between(body, touched, samples.spacing_mm)])
    if not len(outside):
        return fine, parent, corners
    trees = cKDTree(samples.points.places[carries]), cKDTree(outside)
    for limit in surface.edge_mm * 2.0 ** np.arange(LEVELS)[::-1]:
        at = fine.vertices[fine.faces]
        longest = ((np.roll(at, -1, axis=1) - at) ** 2).sum(axis=2).max(axis=1)
        rows = np.flatnonzero(touched[parent] & (longest > limit**2))
        middle = at[rows].mean(axis=1, keepdims=True)
        reach = np.linalg.norm(at[rows] - middle, axis=2).max(axis=1) + samples.spacing_mm
        for tree in trees:
            near = tree.query(middle[:, 0])[0] <= reach
            rows, middle, reach = rows[near], middle[near], reach[near]
        if len(rows):
            step = refined(fine, float(limit), flagged(rows, len(parent)))
            fine, corners = step.body, np.einsum("fkc,fcd->fkd", step.corners, corners[step.parent])
            parent = parent[step.parent]
    return fine, parent, corners


def _apart(vertices: Array, patch: Index, rest: Index, parent: Index) -> tuple[Body, Rest]:
    """Triangles of a patch with its border first, and the rest with parents, of two sets of triangles."""
    in_patch, in_rest = (flagged(faces, len(vertices)) for faces in (patch, rest))
    border, inner, others = (
        np.flatnonzero(chosen) for chosen in (in_patch & in_rest, in_patch & ~in_rest, in_rest & ~in_patch)
    )
    own, number = np.concatenate([border, inner]), np.full(len(vertices), -1)
    number[own] = np.arange(len(own))
    body = Body(vertices[own], number[patch])
    number[others] = len(border) + np.arange(len(others))
    return body, Rest(vertices[others], number[rest], len(border), parent)


def _around(faces: Index, chosen: Flags, count: int) -> Index:
    """Numbers of chosen triangles, (m,) of faces (m, 3), with `RINGS` rings around them."""
    for _ in range(RINGS):
        chosen = np.asarray(flagged(faces[chosen], count)[faces].any(axis=1))
    return np.flatnonzero(chosen)


def _patch(
    surface: FileSurface, body: Body, rest: Rest, parent: Index, corners: Array, facets: Index
) -> Patch:
    """The patch of triangles on the smooth surface behind the file's facets, (k,) numbers."""
    how = surface.settings.facets or "auto"
    exact = None if surface.exact is None else surface.exact[facets]
    smooth = smooth_surface(surface.body.part(facets), surface.bottom[facets], how, exact)
    place = np.full(len(surface.body.faces), -1)
    place[facets] = np.arange(len(facets))
    far = RISE * surface.settings.falloff_mm
    on_border = np.arange(len(body.vertices)) < rest.border
    rise = smooth_step(np.minimum(ways_from(body, on_border, far), far) / far)
    uv = None if surface.uv is None else surface.uv[facets]
    return Patch(smooth, body, place[parent], corners, rise, rest.border, rest.edges, uv)
