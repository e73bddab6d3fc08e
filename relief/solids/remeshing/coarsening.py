"""Decimation of the flat parts of an even mesh without texture."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, Index, sums_by, units
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_pairs
from relief.solids.remeshing.collapsing import Collapses
from relief.solids.remeshing.even_mesh import EvenMesh
from relief.solids.remeshing.flipping import Flips
from relief.solids.remeshing.triangles import Triangles, repeated

COARSEST = 16.0
"""Edges in the middle of a large plane, in those of the even mesh: longer ones would save few triangles."""
ROUNDS = 4
"""Rounds of collapses and flips; each lets edges beside the rest grow further."""
SAME_PLANE = np.cos(np.radians(0.05))
"""Cosine of the angle between normals of one plane: rounding of files in single precision turns less."""
FLAT_MM = 0.0025
"""Distance from its plane, mm, up to which a part of the surface is flat: half of `HELD_MM`."""


def coarsened(mesh: EvenMesh, kept: NDArray[np.bool_], edge_mm: float) -> tuple[EvenMesh, Index]:
    """The mesh with fewer triangles on its flat parts, and the numbers (k,) of the vertices that are left.

    Vertices of triangles that are kept or not flat stay; along a straight edge between two planes some go. A
    mesh with texture coordinates is unchanged.

    Args:
        mesh: Even triangles.
        kept: (faces,) triangles that stay as they are.
        edge_mm: Edges of the even mesh, mm.
    """
    faces, pairs = mesh.body.faces, edge_pairs(mesh.body.faces)
    plane = _planes(mesh, kept, pairs)
    if mesh.uv is not None or not (plane >= 0).any():
        return mesh, np.arange(len(mesh.body.vertices))
    stays = np.zeros(len(mesh.body.vertices), bool)
    stays[faces[plane < 0]] = True
    held = np.ones(3 * len(faces), bool)
    inside = plane[pairs[:, 0] // 3] == plane[pairs[:, 1] // 3]
    held[pairs[inside & (plane[pairs[:, 0] // 3] >= 0)].ravel()] = False
    size = np.where(stays, edge_mm, COARSEST * edge_mm)
    triangles = Triangles(mesh.body, held.reshape(-1, 3), stays, size)
    for _ in range(ROUNDS):
        wanted, collapses = triangles.wanted(), Collapses(triangles)
        repeated(partial(collapses.collapse, wanted))
        repeated(Flips(triangles).flip)
    left = np.unique(triangles.faces)
    triangles.drop_unused()
    own = triangles.origin
    return replace(
        mesh,
        body=Body(triangles.vertices, triangles.faces),
        normals=mesh.normals[own],
        bulges=np.where((plane[own] >= 0)[:, None, None], 0.0, mesh.bulges[own]),
        origin=mesh.origin[own],
    ), left


def _planes(mesh: EvenMesh, kept: NDArray[np.bool_], pairs: Index) -> Index:
    """(faces,) numbers of the planes of flat triangles that are not kept; -1: of none.

    Args:
        mesh: Even triangles.
        kept: (faces,) triangles that are of no plane.
        pairs: (n, 2) half-edges on both sides of edges.
    """
    body = mesh.body
    unit = units(body.normals)
    flat = ~kept & ((mesh.normals * unit[:, None]).sum(axis=2).min(axis=1) > SAME_PLANE)
    flat &= np.linalg.norm(mesh.bulges, axis=2).max(axis=1) < FLAT_MM
    one, other = pairs.T // 3
    beside = flat[one] & flat[other] & ((unit[one] * unit[other]).sum(axis=1) > SAME_PLANE)
    plane = connected(pairs[beside] // 3, len(body.faces))
    far = _distances(body, plane, int(plane.max()) + 1)
    return np.where(flat & (far[plane] < FLAT_MM), plane, -1)


def _distances(body: Body, group: Index, number: int) -> Array:
    """(number,) largest distances of the corners of groups of triangles from their mean planes, mm."""
    corners = body.vertices[body.faces]
    normal = units(sums_by(group, body.normals, number))
    middle = sums_by(group, corners.mean(axis=1), number) / np.bincount(group, minlength=number)[:, None]
    far = np.zeros(number)
    off = np.abs(((corners - middle[group][:, None]) * normal[group][:, None]).sum(axis=2)).max(axis=1)
    np.maximum.at(far, group, off)
    return far
