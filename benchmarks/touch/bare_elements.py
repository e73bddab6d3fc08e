"""Finite elements alone: the reference without its exact layer, to compare with.

With sliding sides, which act as mirrors, cosines at the pixel centres are the modes of the mesh of
`tactile.structured.pixel_block`, and each mode needs only a small system along the depth: a discrete layer.
The exact layer (`tactile.layer.layer_response`) minus the discrete one is the discretisation error of the
elements under the shortest waves, where the error is largest.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch

from relief.ground.arrays import Array
from tactile.elements.finite_elements import FiniteElementOperator, finite_element_operator, graded_levels
from tactile.skin import Skin, lame
from tactile.structured.along_axes import kinds_along, matrices_along
from tactile.structured.pixel_block import PixelBlock

CHUNK = 512
"""Modes solved at a time: bounds the memory of their systems (45 x 45 numbers each) to about 10 MB."""


@dataclass(frozen=True)
class DiscreteLayer:
    """Response of the elements to unit pressure in each of the n² cosine modes, at E = 1 MPa.

    Attributes:
        surface: (n, n) normal displacement of the face, mm.
        strain: (6, n, n) at the receptors; components as in `tactile.strain.STRAIN_COMPONENTS`.
    """

    surface: Array
    strain: Array


def bare_elements(skin: Skin, samples: int, size_mm: float) -> FiniteElementOperator:
    """The operator of a skin by elements alone, with a node at every pixel.

    Args:
        skin: all but force and modulus matters here.
        samples: n, even.
        size_mm: side of the patch.
    """
    levels = graded_levels(skin.thickness_mm, size_mm / samples, skin.stack)
    mesh = PixelBlock(size_mm / 2.0, samples // 2, levels, skin.depth_mm, skin.poisson_ratio, skin.stack)
    layer = discrete_layer(mesh)
    surface, strain = torch.as_tensor(layer.surface), torch.as_tensor(layer.strain)
    return replace(finite_element_operator(skin, samples, size_mm), symbol=surface, strain_symbols=strain)


def discrete_layer(block: PixelBlock) -> DiscreteLayer:
    """The symbols of the elements.

    Displacements are U sin cos (row), V cos sin (column), W cos cos (depth) in the plane, piecewise linear
    along the depth.

    Args:
        block: the mesh; of its quarter only the number of pixels and their pitch matter.
    """
    n = 2 * block.half
    row, column = (
        a.ravel() for a in np.meshgrid(*(np.pi * np.arange(n) / n,) * 2, indexing="ij")
    )  # phase per pixel
    surface, strain = np.empty(n * n), np.empty((6, n * n))
    for first in range(0, n * n, CHUNK):
        here = slice(first, first + CHUNK)
        surface[here], strain[:, here] = _modes(block, row[here], column[here])
    return DiscreteLayer(surface.reshape(n, n), strain.reshape(6, n, n))


def _modes(block: PixelBlock, row: Array, column: Array) -> tuple[Array, Array]:
    pitch, free = block.pitch_mm, len(block.levels) - 1
    matrix = _stiffness(block, (row, column))
    load = np.zeros((3, free))
    load[2, 0] = pitch**2
    loads = np.broadcast_to(load.ravel(), (row.size, 3 * free))[..., None]
    solution = np.asarray(np.linalg.solve(matrix, loads)[..., 0], dtype=np.float64)
    field = solution.reshape(-1, 3, free)
    value, slope = block.at_depth(False), block.at_depth(True)
    at_depth, with_depth = field @ value, field @ slope
    u, v, w = at_depth.T
    # Symbol of the five-point difference by which `tactile.structured.pixel_block` reads strains.
    by_row, by_column = ((8.0 * np.sin(t) - np.sin(2.0 * t)) / (6.0 * pitch) for t in (row, column))
    strain = np.stack(
        (
            by_row * u,
            by_column * v,
            with_depth[:, 2],
            0.5 * (with_depth[:, 1] - by_column * w),
            0.5 * (with_depth[:, 0] - by_row * w),
            -0.5 * (by_row * v + by_column * u),
        )
    )
    return field[:, 2, 0], strain


def _stiffness(block: PixelBlock, phases: tuple[Array, Array]) -> Array:
    """(modes, 3 * levels, 3 * levels), the bonded level left out."""
    lam, mu = lame(1.0, block.poisson_ratio)
    free = len(block.levels) - 1
    along_depth = {
        kind: m.toarray()[:-1, :-1] for kind, m in matrices_along(block.levels, block.moduli).items()
    }

    def in_plane(axis: int, test: int, trial: int, kind: str) -> Array:
        """Integral along a row or column of two modes, per half a row: sines along their own axis."""
        phase, pitch = phases[axis], block.pitch_mm
        if kind == "mass":
            return pitch * (2.0 + np.cos(phase)) / 3.0
        if kind == "centre":
            return pitch * (1.0 + np.cos(phase)) / 2.0
        if kind == "slopes":
            return 2.0 * (1.0 - np.cos(phase)) / pitch
        sloping = test if kind == "slope_value" else trial
        return np.sin(phase) if sloping == axis else -np.sin(phase)

    def integral(test: int, by_test: int, trial: int, by_trial: int, mass: str) -> Array:
        kinds = kinds_along(by_test, by_trial, mass)
        plane = in_plane(0, test, trial, kinds[0]) * in_plane(1, test, trial, kinds[1])
        return plane[:, None, None] * along_depth[kinds[2]]

    modes = phases[0].size
    matrix = np.zeros((modes, 3, free, 3, free))
    for c in range(3):
        for d in range(3):
            matrix[:, c, :, d] = lam * integral(c, c, d, d, "centre") + mu * integral(c, d, d, c, "mass")
            if c == d:
                matrix[:, c, :, c] += mu * sum(integral(c, a, c, a, "mass") for a in range(3))
    for axis in (0, 1):
        # A sine of phase zero is no mode; its unknowns are held at zero, and the system stays regular.
        still = np.flatnonzero(np.sin(phases[axis]) == 0.0)
        matrix[still, axis] = 0.0
        matrix[still, :, :, axis] = 0.0
        matrix[still[:, None], axis, np.arange(free), axis, np.arange(free)] = 1.0
    return matrix.reshape(modes, 3 * free, 3 * free)
