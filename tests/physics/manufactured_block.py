"""Manufactured solutions of the skin block: displacement fields with their forces and strains.

Roache, J. Fluids Eng. 124 (2002): choose a solution, derive its loads, and watch the error fall. Every
component is a product of one cosine along each axis; a derivative shifts a cosine's phase by a quarter turn.
Unit Young's modulus; axes are (row, column, depth), the mirror planes at 0, the bone at the thickness.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array
from tactile.layer.cosine_layer import Parity
from tactile.skin import lame
from tactile.sparse import factorised
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.pixel_block import PixelBlock
from tests.tactile.folded_block import strain_at_depth

Axes = tuple[Array, Array, Array]
GAUSS = np.polynomial.legendre.leggauss(3)


@dataclass(frozen=True)
class Wave:
    """u_c = a_c cos(k_0 x + f_c0) cos(k_1 y + f_c1) cos(k_2 z + f_c2).

    Attributes:
        amplitude: (3,) mm.
        wavenumber: (3,) 1/mm.
        phase: (3, 3) by component and axis.
    """

    amplitude: Array
    wavenumber: Array
    phase: Array

    def derivative(self, component: int, by: tuple[int, ...], axes: Axes) -> Array:
        result = np.array(self.amplitude[component])
        for axis, x in enumerate(axes):
            order, k = by.count(axis), self.wavenumber[axis]
            along = k**order * np.cos(k * x + self.phase[component, axis] + 0.5 * np.pi * order)
            result = np.multiply.outer(result, along)
        return result


@dataclass(frozen=True)
class Field:
    """A sum of waves, zero at the bone."""

    waves: tuple[Wave, ...]
    poisson_ratio: float

    def derivative(self, component: int, by: tuple[int, ...], axes: Axes) -> Array:
        """Of a component by the axes listed, on the tensor grid of three coordinates."""
        return np.sum([wave.derivative(component, by, axes) for wave in self.waves], axis=0)

    def stress(self, a: int, b: int, axes: Axes) -> Array:
        lam, mu = lame(1.0, self.poisson_ratio)
        shear = mu * (self.derivative(a, (b,), axes) + self.derivative(b, (a,), axes))
        volume = np.sum([self.derivative(c, (c,), axes) for c in range(3)], axis=0)
        return shear + (lam if a == b else 0.0) * volume

    def body_force(self, component: int, axes: Axes) -> Array:
        """Minus the divergence of stress (Navier): -(lambda + mu) grad div u - mu laplace u."""
        lam, mu = lame(1.0, self.poisson_ratio)
        dilation = np.sum([self.derivative(c, (c, component), axes) for c in range(3)], axis=0)
        laplace = np.sum([self.derivative(component, (axis, axis), axes) for axis in range(3)], axis=0)
        return -(lam + mu) * dilation - mu * laplace


def compressible(parity: Parity, thickness_mm: float, poisson_ratio: float) -> Field:
    """A field with the symmetry of a load of this parity; its volume changes everywhere."""
    k = np.array([0.7, 0.5, 0.9])
    phase = _phases(parity, 0.5 * np.pi - k[2] * thickness_mm)
    return Field((Wave(np.array([0.3, -0.2, 0.4]), k, phase),), poisson_ratio)


def isochoric(parity: Parity, thickness_mm: float, poisson_ratio: float) -> Field:
    """A field that keeps its volume: lateral profile sin(k (t - z)), normal profile 1 - cos(k (t - z))."""
    k = np.array([0.7, 0.5, 0.9])
    signs = np.array([-1.0 if odd else 1.0 for odd in parity])  # a cosine falls, a sine rises
    lateral = 0.5 * k[2] / (signs * k[:2])
    bent = _phases(parity, -k[2] * thickness_mm)
    bent[:2, 2] += 0.5 * np.pi
    lifted = _phases(parity, 0.0)
    return Field(
        (
            Wave(0.3 * np.array([*lateral, -1.0]), k, bent),
            Wave(0.3 * np.array([0.0, 0.0, 1.0]), k * [1.0, 1.0, 0.0], lifted),
        ),
        poisson_ratio,
    )


def _phases(parity: Parity, in_depth: float) -> Array:
    """Sines where a component is odd along an axis, cosines where it is even."""
    phase = np.full((3, 3), in_depth)
    for component in range(3):
        for axis, odd in enumerate(parity):
            phase[component, axis] = -0.5 * np.pi if (component == axis) != odd else 0.0
    return phase


def errors(block: PixelBlock, parity: Parity, field: Field, stiffness: sp.spmatrix) -> tuple[float, float]:
    """Relative L2 errors of the displacement in the quarter and of the strain at the receptors.

    Args:
        stiffness: of the quarter, as from `tests.tactile.folded_block.folded_stiffness`.
    """
    solution = factorised(stiffness)(_forces(block, parity, field))
    places, weights = zip(*(_quadrature(e) for e in _elements(block)), strict=True)
    displacement = solution.reshape(3, block.half + 1, block.half + 1, -1)
    wrong, size = 0.0, 0.0
    for c in range(3):
        hats = _hats(block, parity, c, places)
        exact = field.derivative(c, (), places)
        difference = np.einsum("ijk,ri,sj,tk->rst", displacement[c], *hats, optimize=True) - exact
        wrong += np.einsum("rst,r,s,t->", difference**2, *weights, optimize=True)
        size += np.einsum("rst,r,s,t->", exact**2, *weights, optimize=True)

    strain = strain_at_depth(block, parity, solution.reshape(-1, 1))[..., 0]
    receptors = (block.line[1:-1], block.line[1:-1], np.array([block.depth_mm]))
    expected = np.stack(
        [
            0.5 * (field.derivative(a, (b,), receptors) + field.derivative(b, (a,), receptors)).ravel()
            for a, b in STRAIN_COMPONENTS
        ]
    )
    return float(np.sqrt(wrong / size)), float(np.linalg.norm(strain - expected) / np.linalg.norm(expected))


def _forces(block: PixelBlock, parity: Parity, field: Field) -> Array:
    """Nodal forces: the body forces of the field and its tractions on face and sides."""
    places, weights = zip(*(_quadrature(e) for e in _elements(block)), strict=True)
    loads = []
    for c in range(3):
        hats = _hats(block, parity, c, places)
        weighted = [h * w[:, None] for h, w in zip(hats, weights, strict=True)]
        load = np.einsum("rst,ri,sj,tk->ijk", field.body_force(c, places), *weighted, optimize=True)
        for axis, (end, outward) in enumerate(((block.half_mm, 1.0), (block.half_mm, 1.0), (0.0, -1.0))):
            on_face = list(places)
            on_face[axis] = np.array([end])
            at = tuple(on_face)
            across = list(weighted)
            across[axis] = _hats(block, parity, c, at)[axis]
            load += np.einsum(
                "rst,ri,sj,tk->ijk", outward * field.stress(c, axis, at), *across, optimize=True
            )
        loads.append(load.ravel())
    return np.concatenate(loads)


def _elements(block: PixelBlock) -> Axes:
    """Ends of the elements along each axis, in the quarter: that across the mirror plane ends there."""
    line = np.concatenate(([0.0], block.line[1:]))
    return line, line, block.levels


def _quadrature(ends: Array) -> tuple[Array, Array]:
    """Gauss points and weights of every element along an axis."""
    middle, radius = 0.5 * (ends[1:] + ends[:-1]), 0.5 * np.diff(ends)
    points, weights = GAUSS
    return (middle[:, None] + radius[:, None] * points).ravel(), (radius[:, None] * weights).ravel()


def _hats(block: PixelBlock, parity: Parity, component: int, places: Axes) -> list[Array]:
    """(points, nodes) along each axis: linear between nodes; level at a mirror plane, or zero there."""
    hats = []
    for axis, x in enumerate(places):
        if axis == 2:
            identity = np.eye(len(block.levels))
            hats.append(np.stack([np.interp(x, block.levels, e) for e in identity[:-1]], axis=1))
            continue
        odd = (component == axis) != parity[axis]
        ends = _elements(block)[axis]
        identity = np.eye(block.half + 1)
        at_mirror = np.zeros(block.half + 1) if odd else identity[0]
        hats.append(
            np.stack(
                [np.interp(x, ends, np.append(m, e)) for m, e in zip(at_mirror, identity, strict=True)], 1
            )
        )
    return hats
