"""Quadratic hexahedra of a pad of even thickness, on a bone that follows its round skin.

The skin is the paraboloid z = r²/(2a) + c²/(2b) over rows r and columns c. The pad lies between the skin and
the bone, which is the skin moved by the thickness along its normals, and is bonded. A tensor grid over (r, c,
depth along the normal) is mapped there, so that elements are aligned with the layers of the skin.
Triquadratic elements of 27 nodes, mapped by quadratics of their own (isoparametric, so linear displacements
are exact), are integrated by 3 x 3 x 3 Gauss points: unlike trilinear ones they do not lock at nu = 0.48.

A quarter stands for the pad, as the patch has two mirror planes: a load is even or odd about each. Sides do
not move along the axis that they cross, and slide along the others: those of a flat pad are mirrors then, as
those of `tactile.layer.cosine_layer`. Axes are (row, column, depth); Young's modulus is 1 in the base.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from relief.ground.arrays import Array
from tactile.layer.cosine_layer import Parity
from tactile.layer.skin_layers import Stack, levels_within, moduli_of_rows
from tactile.skin import lame
from tactile.strain import STRAIN_COMPONENTS

NODES = 3
"""Nodes of an element along an axis."""
CHUNK = 256
"""Elements assembled at a time: 81 x 81 numbers each, 13 MB together."""


@dataclass(frozen=True)
class RoundPad:
    """Mesh of a quarter of the pad.

    Attributes:
        rows, columns: ends of the elements along the axis, from 0 to half the side of the patch, mm.
        levels: ends of the elements along the depth, from 0 to the thickness, among them the boundaries of
            the layers.
        radii_mm: of the skin along rows and columns; infinite ones are those of a flat pad.
        poisson_ratio: nu.
        stack: layers above the base, whose modulus is 1.
    """

    rows: Array
    columns: Array
    levels: Array
    radii_mm: tuple[float, float]
    poisson_ratio: float
    stack: Stack = ()

    @property
    def axes(self) -> tuple[Array, Array, Array]:
        """Ends of the elements along each axis."""
        return self.rows, self.columns, self.levels

    @property
    def shape(self) -> tuple[int, int, int]:
        """Nodes along each axis."""
        rows, columns, depths = (2 * len(ends) - 1 for ends in self.axes)
        return rows, columns, depths

    @cached_property
    def positions(self) -> Array:
        """(*shape, 3) nodes, mm."""
        lines = [
            np.interp(np.arange(2 * len(ends) - 1) / 2, np.arange(len(ends)), ends) for ends in self.axes
        ]
        row, column, depth = np.meshgrid(*lines, indexing="ij")
        slopes = row / self.radii_mm[0], column / self.radii_mm[1]
        rise = 0.5 * (row * slopes[0] + column * slopes[1])
        inward = depth / np.sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)
        return np.stack((row - slopes[0] * inward, column - slopes[1] * inward, rise + inward), axis=-1)

    @property
    def elements(self) -> NDArray[np.int64]:
        """(elements, 27) nodes of each, numbered along the depth first."""
        numbers = np.arange(np.prod(self.shape)).reshape(self.shape)
        windows = np.lib.stride_tricks.sliding_window_view(numbers, (NODES,) * 3)[::2, ::2, ::2]
        return windows.reshape(-1, NODES**3)

    def stiffness(self) -> sp.csr_matrix:
        """(3 nodes, 3 nodes) of all displacements, node by node; its upper triangle only.

        Raises:
            ValueError: an element is turned inside out, as the pad is thicker than the skin is round.
        """
        elements = self.elements
        moduli = np.tile(moduli_of_rows(self.levels, self.stack), len(elements) // (len(self.levels) - 1))
        size = 3 * int(np.prod(self.shape))
        matrix = sp.csr_matrix((size, size))
        upper = np.triu_indices(3 * NODES**3)
        parts = []
        for first in range(0, len(elements), CHUNK):
            nodes = elements[first : first + CHUNK]
            block = self._element_stiffness(nodes, moduli[first : first + CHUNK])
            unknowns = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1).astype(np.int32)
            one, other = unknowns[:, upper[0]], unknowns[:, upper[1]]
            values = block[:, upper[0], upper[1]].ravel()
            entries = (np.minimum(one, other).ravel(), np.maximum(one, other).ravel())
            parts.append(sp.csr_matrix((values, entries), shape=(size, size)))
            if len(parts) == 8:
                matrix, parts = sum(parts, matrix), []
        return sp.csr_matrix(sum(parts, matrix))

    def _element_stiffness(self, nodes: NDArray[np.int64], moduli: Array) -> Array:
        """(elements, 81, 81)."""
        slopes, weights = _reference()
        corners = self.positions.reshape(-1, 3)[nodes]
        jacobian = np.einsum("qnd,enx->eqxd", slopes, corners)
        volume = np.linalg.det(jacobian)
        if volume.min() <= 0.0:
            raise ValueError("an element is inside out: the pad is thicker than its skin is round")
        gradient = np.matmul(slopes, np.linalg.inv(jacobian))  # (elements, points, 27, 3)
        flat = gradient.reshape(*gradient.shape[:2], -1)
        factor = moduli[:, None] * volume * weights
        pairs = np.matmul((flat * factor[..., None]).swapaxes(1, 2), flat)
        pairs = pairs.reshape(len(nodes), NODES**3, 3, NODES**3, 3)  # [e, i, a, j, b]: of dN_i/da dN_j/db
        lam, mu = lame(1.0, self.poisson_ratio)
        block = lam * pairs + mu * pairs.swapaxes(2, 4)
        laplace = mu * np.einsum("eiaja->eij", pairs)
        for axis in range(3):
            block[:, :, axis, :, axis] += laplace
        return block.reshape(len(nodes), 3 * NODES**3, -1)

    def free(self, parity: Parity) -> NDArray[np.intp]:
        """Unknowns that move under loads of a parity, among all displacements."""
        moves = np.ones((*self.shape, 3), dtype=bool)
        moves[:, :, -1] = False
        for axis, odd in enumerate(parity):
            # On the mirror plane an even load leaves the displacement across it zero, an odd one the others.
            along = moves.swapaxes(0, axis)
            along[0, ..., [other != axis if odd else other == axis for other in range(3)]] = False
            along[-1, ..., axis] = False
        return np.flatnonzero(moves)

    def strains(self, displacements: Array, depth_mm: float, points: tuple[Array, Array]) -> Iterator[Array]:
        """Strains below points of the skin: of each pair in `STRAIN_COMPONENTS`, (rows, columns, k).

        Slopes of quadratic elements are most exact at two Gauss points along each axis. Along the depth, the
        strain is that of a polynomial through the points of the two nearest rows of the same layer.

        Args:
            displacements: (*shape, 3, k).
            depth_mm: along the normals of the skin; on a boundary between layers, the lower one's.
            points: along rows and columns, mm; best at two Gauss points of each element.
        """
        depths, weights = self.reading(depth_mm)
        last = 2 * int(np.searchsorted(self.levels, depths.max())) + 1
        first = 2 * int(np.searchsorted(self.levels, depths.min())) - 2
        near, ends = slice(first, last), self.levels[first // 2 : last // 2 + 1]
        axes = zip((self.rows, self.columns, ends), (*points, depths), strict=True)
        value, slope = zip(
            *((quadratics(*axis, False), quadratics(*axis, True)) for axis in axes), strict=True
        )

        def derivative(field: Array, by: int) -> Array:
            """Derivative at the points along an axis, of a field (rows, columns, depths, ...) on nodes."""
            for axis in range(3):
                matrix = (slope if by == axis else value)[axis]
                field = np.tensordot(matrix, field, axes=(1, axis))
                field = np.moveaxis(field, 0, axis)
            return field

        inverse = np.linalg.inv(
            np.stack([derivative(self.positions[:, :, near], by) for by in range(3)], axis=-1)
        )
        inverse *= weights[:, None, None]
        on_grid = [derivative(displacements[:, :, near], by) for by in range(3)]

        def gradient(component: int, by: int) -> Array:
            """Derivative of a displacement component along a direction in space."""
            terms = (
                np.einsum("rcd,rcdk->rck", inverse[..., axis, by], on_grid[axis][..., component, :])
                for axis in range(3)
            )
            return np.asarray(sum(terms))

        for a, b in STRAIN_COMPONENTS:
            yield gradient(a, a) if a == b else 0.5 * (gradient(a, b) + gradient(b, a))

    def reading(self, depth_mm: float) -> tuple[Array, Array]:
        """Depths, mm, at which strain is read, and the weights of their polynomial at a depth."""
        here = levels_within(self.levels, depth_mm, self.stack)
        inside = self.levels[here]
        row = int(np.clip(np.searchsorted(inside, depth_mm) - 1, 0, len(inside) - 2))
        nearer = row - 1 if depth_mm - inside[row] < inside[row + 1] - depth_mm else row
        first = int(np.clip(nearer, 0, max(len(inside) - 3, 0)))
        depths, _ = gauss_points(inside[first : first + 3], 2)
        others = depths[:, None] != depths
        factors = np.where(others, (depth_mm - depths) / np.where(others, depths[:, None] - depths, 1.0), 1.0)
        return depths, factors.prod(axis=1)


def quadratics(ends: Array, places: Array, derivative: bool) -> Array:
    """(places, nodes) values or slopes, at places along an axis, of the quadratic hats of its nodes.

    Args:
        ends: of the elements; nodes are these and the middles between them.
        places: (k,) between the first end and the last.
        derivative: whether slopes are returned instead of values.
    """
    element = np.clip(np.searchsorted(ends, places, side="right") - 1, 0, len(ends) - 2)
    half = 0.5 * (ends[element + 1] - ends[element])
    local = (places - ends[element]) / half - 1.0
    hats = (
        np.stack((local - 0.5, -2.0 * local, local + 0.5)) / half
        if derivative
        else np.stack((0.5 * local * (local - 1.0), 1.0 - local**2, 0.5 * local * (local + 1.0)))
    )
    result = np.zeros((places.size, 2 * len(ends) - 1))
    result[np.arange(places.size)[:, None], 2 * element[:, None] + np.arange(NODES)] = hats.T
    return result


def gauss_points(ends: Array, points: int) -> tuple[Array, Array]:
    """Places and weights, mm, of a Gauss rule of so many points in each element along an axis."""
    local, weights = np.polynomial.legendre.leggauss(points)
    half = 0.5 * np.diff(ends)[:, None]
    return (ends[:-1, None] + half * (1.0 + local)).ravel(), (half * weights).ravel()


@cache
def _reference() -> tuple[Array, Array]:
    """Slopes (points, 27, 3) of the hats of an element from -1 to 1 at its Gauss points, and weights."""
    ends = np.array([-1.0, 1.0])
    points, weights = gauss_points(ends, NODES)
    value, slope = (quadratics(ends, points, derivative) for derivative in (False, True))
    slopes = [
        np.einsum("ai,bj,ck->abcijk", *(slope if axis == by else value for axis in range(3)))
        for by in range(3)
    ]
    cubic = np.einsum("a,b,c->abc", weights, weights, weights).ravel()
    return np.stack(slopes, axis=-1).reshape(NODES**3, NODES**3, 3), cubic
