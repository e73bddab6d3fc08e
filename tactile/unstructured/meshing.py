"""Tetrahedra inside a closed surface, by fTetWild (pytetwild) in a process of its own.

Hu, Schneider, Wang, Zorin and Panozzo, "Fast Tetrahedral Meshing in the Wild" (ACM Trans. Graph. 39, 2020).
fTetWild's meshes stay within an envelope around the surface. Here their boundary is projected back onto the
surface, so that flat faces are flat and a block has the volume of a block.
"""

import hashlib
import subprocess
import sys
import tempfile
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from itertools import permutations
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.cache import Arrays, cached, fingerprint
from relief.ground.errors import InputError
from tactile.unstructured.surface import ClosedSurface, outward_normals

CHILD = Path(__file__).resolve().with_name("tetwild.py")
ENVELOPE = 1e-3
"""Half width of fTetWild's envelope over the bounding box's diagonal: 1e-4 takes fifteen times longer."""
SNAP = 2.0
"""Distance, in envelopes, up to which a vertex of the boundary is projected onto a face of the surface: twice
the distance that fTetWild allows."""
PLANE_AREA = 0.05
"""Least area of a flat face that is kept exactly, as a share of the largest one: all sides of a block have
more, triangles of a curved face less."""
BESIDE_MM = 3.0
"""Distance, mm, over which edges grow to their length at the bone beside `Sizing.within_mm`."""
TIME_LIMIT_S = 600.0
"""Seconds after which meshing is given up."""
BACKGROUND = (8, 8, 16)
"""Cells of the background grid of edge lengths along x, y and z: most along z, as lengths vary with depth."""


class MeshingError(RuntimeError):
    """A surface could not be meshed: one line that says why."""


@dataclass(frozen=True)
class Sizing:
    """Target lengths of the tetrahedra's edges, mm, growing evenly from the contact face to the bone.

    At the rim of the bone strain is singular: with edges of 0.8 mm a flat plate's approach is 0.7 % less than
    with 0.4 mm, and roughness is the same.

    Attributes:
        contact_mm: edge length at the contact face.
        bone_mm: edge length at the bone.
        within_mm: distance from the axis, along x or y, from which edges grow with the distance as well.

    Raises:
        InputError: not 0.02 <= contact_mm <= bone_mm <= 10.
    """

    contact_mm: float = 0.25
    bone_mm: float = 0.8
    within_mm: float = 100.0

    def __post_init__(self) -> None:
        if not 0.02 <= self.contact_mm <= self.bone_mm <= 10.0:
            raise InputError(
                f"sizing: contact_mm {self.contact_mm} and bone_mm {self.bone_mm} must rise within [0.02, 10]"
            )


@dataclass(frozen=True)
class Tetrahedra:
    """Mesh of tetrahedra.

    Attributes:
        vertices: (n, 3) mm.
        cells: (m, 4) vertex indices, of positive volume.
    """

    vertices: Array
    cells: NDArray[np.int64]

    def boundary(self) -> NDArray[np.int64]:
        """(k, 3) triangles that belong to one tetrahedron only, counter-clockwise seen from outside."""
        faces = np.concatenate([self.cells[:, face] for face in ([1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1])])
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return np.asarray(faces[np.sort(first[count == 1])])


def signed_volumes(vertices: Array, cells: NDArray[np.integer]) -> Array:
    """(m,) volumes of tetrahedra, mm³, negative where the vertices are listed with the other orientation."""
    first = vertices[cells[:, 0]]
    return np.asarray(np.linalg.det(vertices[cells[:, 1:]] - first[:, None]) / 6.0)


def tetrahedralise(surface: ClosedSurface, sizing: Sizing) -> Tetrahedra:
    """Mesh the inside of a surface; the same surface and sizing come from disk the second time.

    (fTetWild's meshes differ a little from run to run even on one thread, so the first one is kept.)

    Args:
        surface: closed, of the skin.
        sizing: edge lengths.

    Raises:
        MeshingError: pytetwild is not installed, took longer than the limit, or failed.
    """
    digest = hashlib.sha256(np.ascontiguousarray(surface.vertices).tobytes())
    digest.update(np.ascontiguousarray(surface.triangles).tobytes())
    key = {"code": fingerprint(__name__), "surface": digest.hexdigest(), **asdict(sizing)}

    def build() -> Arrays:
        vertices, cells = _run(surface, sizing)
        cells = np.where((signed_volumes(vertices, cells) < 0.0)[:, None], cells[:, [0, 1, 3, 2]], cells)
        return {"vertices": _put_back(surface, vertices, cells), "cells": cells}

    layout = {"vertices": ((-1, 3), "f8"), "cells": ((-1, 4), "i8")}
    arrays = cached("tetrahedra", key, build, layout)
    return Tetrahedra(arrays["vertices"], arrays["cells"])


def _run(surface: ClosedSurface, sizing: Sizing) -> tuple[Array, NDArray[np.int64]]:
    if find_spec("pytetwild") is None:
        raise MeshingError("meshing: pytetwild is missing: pip install 'retouch[tetrahedra]'")
    points, tetrahedra, lengths = _background(surface, sizing)
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder, "surface.npz"), Path(folder, "mesh.npz")
        np.savez(
            source,
            vertices=surface.vertices,
            faces=surface.triangles.astype(np.int32),
            edge_length_abs=sizing.bone_mm,
            epsilon=ENVELOPE,
            num_threads=1,
            bg_vertices=points,
            bg_tets=tetrahedra,
            bg_values=lengths,
        )
        command = [sys.executable, "-P", str(CHILD), str(source), str(target)]
        try:
            # fTetWild leaves a file in its working folder.
            child = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False
            )
        except subprocess.TimeoutExpired as error:
            raise MeshingError(f"meshing: pytetwild took longer than {TIME_LIMIT_S:g} s") from error
        if child.returncode or not target.exists():
            reason = (child.stderr.strip().splitlines() or ["it said nothing"])[-1]
            raise MeshingError(f"meshing: pytetwild failed with exit status {child.returncode}: {reason}")
        with np.load(target) as mesh:
            vertices, cells = mesh["vertices"].astype(np.float64), mesh["cells"].astype(np.int64)
    if len(cells) == 0:
        raise MeshingError("meshing: pytetwild returned no tetrahedra")
    return vertices, cells


def _background(surface: ClosedSurface, sizing: Sizing) -> tuple[Array, NDArray[np.int32], Array]:
    """Points, tetrahedra and target edge lengths at the points of a grid around the surface."""
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
    margin = 0.05 * (high - low)
    axes = [
        np.linspace(a, b, cells + 1)
        for a, b, cells in zip(low - margin, high + margin, BACKGROUND, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape([cells + 1 for cells in BACKGROUND])
    tetrahedra = []
    for order in permutations(range(3)):  # one tetrahedron for each path along the edges of a cell
        corner, corners = np.zeros(3, dtype=int), []
        for axis in (None, *order):
            if axis is not None:
                corner[axis] = 1
            window = tuple(slice(c, c + cells) for c, cells in zip(corner, BACKGROUND, strict=True))
            corners.append(number[window].ravel())
        tetrahedra.append(np.stack(corners, axis=1))
    floor = surface.lower_height(points[:, 0], points[:, 1])
    depth = np.clip((points[:, 2] - floor) / np.maximum(surface.top_mm - floor, sizing.contact_mm), 0.0, 1.0)
    beside = (np.abs(points[:, :2]).max(axis=1) - sizing.within_mm) / BESIDE_MM
    share = np.maximum(depth, np.clip(beside, 0.0, 1.0))
    lengths = sizing.contact_mm + (sizing.bone_mm - sizing.contact_mm) * share
    return points, np.concatenate(tetrahedra).astype(np.int32), lengths


def _put_back(surface: ClosedSurface, vertices: Array, cells: NDArray[np.int64]) -> Array:
    """Vertices with the boundary's projected onto the surface, where no tetrahedron is inverted thereby."""
    reach = SNAP * ENVELOPE * float(np.linalg.norm(np.ptp(surface.vertices, axis=0)))
    outside = np.unique(Tetrahedra(vertices, cells).boundary())
    moved = vertices.copy()
    for normal, offset in _planes(surface):
        distance = moved[outside] @ normal - offset
        near = np.abs(distance) < reach
        moved[outside[near]] -= distance[near, None] * normal
    height = surface.lower_height(*moved[outside, :2].T)
    on_contact_face = np.abs(moved[outside, 2] - height) < reach
    moved[outside[on_contact_face], 2] = height[on_contact_face]
    while (flat := signed_volumes(moved, cells) <= 0.0).any():
        back = np.unique(cells[flat])
        if (moved[back] == vertices[back]).all():
            raise MeshingError("meshing: pytetwild returned tetrahedra without volume")
        moved[back] = vertices[back]
    return moved


def _planes(surface: ClosedSurface) -> list[tuple[Array, float]]:
    """Unit normals and offsets of the large flat faces of a surface."""
    normals = outward_normals(surface.vertices, surface.triangles)
    a, b, c = (surface.vertices[column] for column in surface.triangles.T)
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    offsets = np.einsum("ij,ij->i", normals, a)
    scale = np.abs(surface.vertices).max()
    rounded = np.round(np.column_stack((normals, offsets / scale)), 9) + 0.0  # no minus zero
    planes, first, member = np.unique(rounded, axis=0, return_index=True, return_inverse=True)
    area = np.bincount(member.ravel(), weights=areas, minlength=len(planes))
    return [(normals[i], float(offsets[i])) for i in first[area > PLANE_AREA * area.max()]]
