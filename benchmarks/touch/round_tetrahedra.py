"""Tetrahedra of a round pad: the check of its hexahedra by another mesh, other elements and another assembly.

fTetWild meshes a block, and the mesh is curved like the pad of `tactile.structured.pad_hexahedra`. Quadratic
tetrahedra with straight edges; the bone is bonded, and sides slide as those of the pad do. A layer of another
modulus ends within tetrahedra, which are integrated by more points for it.
"""

from __future__ import annotations

import numpy as np
import skfem
import torch

from relief.ground.arrays import Array
from tactile.layer.layer_response import layer_response
from tactile.skin import Skin
from tactile.sparse import factorised
from tactile.unstructured.meshing import Sizing, Tetrahedra, tetrahedralise
from tactile.unstructured.quadratic import gradients_at, pixel_forces, stiffness
from tactile.unstructured.surface import ClosedSurface
from tactile.unstructured.tetrahedra import TetrahedralOperator

LAYERED_ORDER = 6
"""Order of the quadrature where a boundary of layers may lie within tetrahedra."""


def round_tetrahedra(
    skin: Skin, samples: int, size_mm: float, sizing: Sizing, flat: bool = False
) -> TetrahedralOperator:
    """The operator of a round finger at unit modulus on an n x n patch; or of a flat pad of the same mesh."""
    assert skin.radii_mm is not None
    along, across = (np.inf, np.inf) if flat else skin.radii_mm
    block = tetrahedralise(_block(size_mm, skin.thickness_mm), sizing)
    face = block.boundary()
    face = face[(block.vertices[face, 2] == 0.0).all(axis=1)]
    unbent = _basis(block, skin)
    places = unbent.doflocs.T
    mesh = Tetrahedra(_curved(block.vertices, along, across), block.cells)
    basis = _basis(mesh, skin)

    held = np.zeros((3, basis.N), dtype=bool)
    held[:, np.isclose(places[:, 2], skin.thickness_mm)] = True
    for axis in (0, 1):
        held[axis, np.isclose(np.abs(places[:, axis]), 0.5 * size_mm)] = True
    free = np.flatnonzero(~held.ravel())
    solve = factorised(stiffness(basis, skin.poisson_ratio, _modulus(unbent, skin))[free][:, free])
    forces = pixel_forces(basis, face, samples, size_mm)
    start = int(np.searchsorted(free, 2 * basis.N))
    loaded = free[start:] - 2 * basis.N

    def moved(pressure: Array) -> Array:
        load = np.zeros((free.size, pressure.shape[1]))
        load[start:] = (forces @ pressure)[loaded]
        result = np.zeros((3 * basis.N, pressure.shape[1]))
        result[free] = solve(load)
        return result

    line = (np.arange(samples) + 0.5) * (size_mm / samples) - 0.5 * size_mm
    y, x = np.meshgrid(-line, line, indexing="ij")
    receptors = np.stack((x.ravel(), y.ravel(), np.full(x.size, skin.depth_mm)), axis=1)
    waves = np.hypot(*np.meshgrid(*(np.pi * np.arange(samples) / size_mm,) * 2))
    return TetrahedralOperator(
        samples,
        size_mm,
        torch.as_tensor(0.5 * (y**2 / along + x**2 / across)),
        free.size,
        forces,
        lambda pressure: forces.T @ moved(pressure)[2 * basis.N :],
        moved,
        gradients_at(basis, _curved(receptors, along, across)),
        layer_response(waves, skin.poisson_ratio, skin.thickness_mm, skin.depth_mm).surface,
    )


def _block(size_mm: float, thickness_mm: float) -> ClosedSurface:
    """Surface of a flat block, `size_mm` a side."""
    corners = np.array([*np.ndindex(2, 2, 2)]) * (size_mm, size_mm, thickness_mm)
    quads = np.array([(0, 2, 6, 4), (1, 5, 7, 3), (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6)])
    triangles = np.concatenate((quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]))
    return ClosedSurface(corners - (0.5 * size_mm, 0.5 * size_mm, 0.0), triangles)


def _basis(mesh: Tetrahedra, skin: Skin) -> skfem.Basis:
    tetrahedra = skfem.MeshTet(np.ascontiguousarray(mesh.vertices.T), np.ascontiguousarray(mesh.cells.T))
    return skfem.Basis(tetrahedra, skfem.ElementTetP2(), intorder=LAYERED_ORDER if skin.layers else 2)


def _modulus(block: skfem.Basis, skin: Skin) -> Array:
    """(cells, points) modulus over that of the base, by the depth of the points in the block."""
    depth = np.asarray(block.global_coordinates())[2]
    stack = skin.at_unit_modulus().layers
    ends = np.cumsum([thickness for thickness, _ in stack])
    moduli = np.array([*(modulus for _, modulus in stack), 1.0])
    return np.asarray(moduli[np.searchsorted(ends, depth)])


def _curved(places: Array, along: float, across: float) -> Array:
    """Places (k, 3) in the block, x, y and depth, in the round pad."""
    x, y, depth = places.T
    slope_x, slope_y = x / across, y / along
    inward = depth / np.sqrt(1.0 + slope_x**2 + slope_y**2)
    rise = 0.5 * (x * slope_x + y * slope_y)
    return np.stack((x - slope_x * inward, y - slope_y * inward, rise + inward), axis=1)
