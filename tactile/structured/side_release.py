"""What free sides add to sliding ones, by the modes of a mesh with sliding sides.

Between sliding sides, which act as mirrors, cosines and sines are the modes of a tensor grid, and each mode
is a small system along the depth. Sliding sides hold some motions of the nodes on the sides. With K the
stiffness, f the forces, i the unknowns of the sliding block and s the motions that freed sides add,

    S = K_ss - K_si K_ii^-1 K_is,   r = f_s - K_si K_ii^-1 f_i  (what sliding sides hold),
    u_s = S^-1 r,   u_i = K_ii^-1 f_i - K_ii^-1 K_is u_s,

so that the compliance grows by r' S^-1 r, and only the unknowns on the sides are solved for together. The
result is that of a factorisation of the whole block, to rounding, at a third of the cost.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import ClassVar

import numpy as np
import scipy

from relief.ground.arrays import Array
from tactile.layer.cosine_layer import Parity
from tactile.layer.skin_layers import Stack, moduli_of_rows
from tactile.skin import lame
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.along_axes import fold, kinds_along, matrices_along

MODES, FREED = slice(None, -1), slice(-1, None)
"""Places, in a basis along an axis, of the sliding block's modes and of what freed sides add."""
SIDES = ((FREED, MODES), (MODES, FREED), (FREED, FREED))
"""Sides across the rows, sides across the columns, and their edge, by basis along (row, column)."""
NAMES = "qpe"
"""Index of each of these in sums: the mode along the columns, the mode along the rows, none."""
Part = tuple[slice, slice]
"""Places in the bases along (row, column)."""
ROUNDED = 1e-9
"""Greatest value of a wave that is zero at every node, but for rounding."""


@dataclass(frozen=True)
class Quarter(ABC):
    """Tensor grid on a quarter of the block; axes (row, column, depth), from the mirror planes outward.

    Attributes:
        half_mm: half the side of the block.
        half: loads along half a side.
        levels: node depths, from 0 (contact face) to the thickness (bonded face), among them the boundaries
            of the skin's layers.
        depth_mm: receptor depth.
        poisson_ratio: nu, the same everywhere.
        stack: layers above the base, whose modulus is 1.
        straddling: whether elements straddle the mirror planes. Sliding sides then lie amid elements, too.
    """

    half_mm: float
    half: int
    levels: Array
    depth_mm: float
    poisson_ratio: float
    stack: Stack = ()
    straddling: ClassVar[bool] = False

    @property
    def moduli(self) -> Array:
        """(rows,) Young's modulus of each row of elements."""
        return moduli_of_rows(self.levels, self.stack)

    @property
    @abstractmethod
    def line(self) -> Array:
        """(k,) node positions along an axis, mm; first a ghost, where elements straddle the mirror plane."""

    @property
    @abstractmethod
    def shares(self) -> Array:
        """(nodes, loads) along an axis: the nodes' shares of the loads, without the ghost."""

    @abstractmethod
    def reading(self, slope: bool, odd: bool) -> Array:
        """(points, nodes) along an axis: value or slope of a field, even or odd at the mirror plane."""

    @abstractmethod
    def at_depth(self, derivative: bool) -> Array:
        """(levels - 1,) weights of value or slope at the receptors; the bonded level does not move."""


@dataclass(frozen=True)
class Release:
    """Difference of free sides from sliding ones for a quarter of the block under forces of one parity.

    Attributes:
        face: (rank, loads²) F; the compliance grows by F'F, mm/N at E = 1 MPa.
        strain_in: (rank, loads²) from forces, N, to amplitudes.
        strain_out: (6, points², rank) from amplitudes to strain at receptor depth.
    """

    face: Array
    strain_in: Array
    strain_out: Array


def release(quarter: Quarter, parity: Parity, felt: Array, accuracy: float) -> Release:
    """Difference of free sides from sliding ones.

    Args:
        quarter: the mesh; loads and points are row-major, from the mirror planes outward.
        parity: whether the loads are odd in (row, column).
        felt: (loads², patterns) orthonormal patterns of force that reach the receptors; no others strain.
        accuracy: the greatest part that is left out, in units of the greatest part, of both results.
    """
    bases = [[_basis(quarter, axis == c, parity[axis]) for c in range(3)] for axis in (0, 1)]
    between = _Stiffness(quarter, bases, parity)
    inner = between((MODES, MODES), (MODES, MODES))
    _hold_missing(inner)
    size = inner.shape[-1]
    normal = 2 * size // 3  # place of the face's normal displacement among the unknowns of a mode
    load = np.zeros((*inner.shape[:3], 1))
    load[..., normal, :] = 1.0
    towards = [between((MODES, MODES), side) for side in SIDES]
    solved = np.linalg.solve(inner, np.concatenate((*towards, load), axis=-1))
    *answers, loaded = np.split(solved, size * np.arange(1, 4), axis=-1)

    factor = _schur_complement(between, towards, answers)
    _hold_missing(factor)
    factor = scipy.linalg.cholesky(factor, overwrite_a=True, check_finite=False)
    forces = [basis[2].T @ quarter.shares for basis in bases]
    held = np.concatenate(
        [_held(*each, loaded, forces, normal) for each in zip(SIDES, NAMES, towards, strict=True)]
    )
    root = scipy.linalg.solve_triangular(factor, held, trans="T", check_finite=False)
    values, loads = _greatest(root.T @ root, accuracy)
    motions = scipy.linalg.solve_triangular(factor, root @ felt, check_finite=False)
    strain = _strain(quarter, bases, parity, answers, motions)
    _, amplitudes = _greatest(strain.T @ strain, accuracy**2)
    return Release(
        (loads * np.sqrt(values)).T,
        (felt @ amplitudes).T,
        (strain @ amplitudes).reshape(len(STRAIN_COMPONENTS), -1, amplitudes.shape[1]),
    )


def _hold_missing(matrices: Array) -> None:
    """Hold unknowns without stiffness (a sine of phase zero is no mode), so that systems stay regular."""
    diagonal = np.einsum("...ii->...i", matrices)
    diagonal[diagonal == 0.0] = 1.0


def _basis(quarter: Quarter, normal: bool, odd: bool) -> Array:
    """(nodes, modes + 1): modes of one displacement component along an axis, and what freed sides add.

    Args:
        quarter: the mesh.
        normal: whether the component points along the axis.
        odd: whether the loads are odd along it.
    """
    nodes = quarter.line[1:] if quarter.straddling else quarter.line
    phases = np.outer(nodes, np.pi * np.arange(odd, 2 * nodes.size - 1, 2) / (2.0 * quarter.half_mm))
    waves = np.sin(phases) if normal != odd else np.cos(phases)
    if normal:
        waves[-1] = 0.0
    elif quarter.straddling:
        waves[-1] = waves[-2]
    waves[:, np.abs(waves).max(0) < ROUNDED] = 0.0
    added = np.zeros((nodes.size, 1))
    added[-1] = normal or quarter.straddling
    return np.concatenate((waves, added), axis=1)


class _Stiffness:
    """Stiffness between parts of the bases; modes of sliding sides are orthogonal."""

    def __init__(self, quarter: Quarter, bases: list[list[Array]], parity: Parity) -> None:
        nodes = quarter.line.size
        weights = np.ones(nodes - 1)
        weights[0] = 0.5 if quarter.straddling else 1.0  # half of a straddling element
        plane = matrices_along(quarter.line, weights)
        depth = matrices_along(quarter.levels, quarter.moduli)
        self.depth = {kind: matrix.toarray()[:-1, :-1] for kind, matrix in depth.items()}
        self.lame = lame(1.0, quarter.poisson_ratio)
        self.plane = dict[tuple[int, int, int, str], Array]()
        for axis, components in enumerate(bases):
            whole = [
                fold(basis.shape[0] - 1, (c == axis) != parity[axis]) @ basis if quarter.straddling else basis
                for c, basis in enumerate(components)
            ]
            for c, d in np.ndindex(3, 3):
                for kind, matrix in plane.items():
                    self.plane[axis, c, d, kind] = whole[c].T @ (matrix @ whole[d])

    def __call__(self, test: Part, trial: Part) -> Array:
        """(rows, columns, 3 * levels, 3 * levels), rows and columns the number of modes or 1."""

        def along(axis: int, c: int, d: int, kind: str) -> Array:
            matrix = self.plane[axis, c, d, kind][test[axis], trial[axis]]
            return np.diag(matrix) if test[axis] is trial[axis] is MODES else matrix.ravel()

        def integral(c: int, by_test: int, d: int, by_trial: int, mass: str) -> Array:
            """Integral of d(test component c)/d(by_test) times d(trial component d)/d(by_trial)."""
            row, column, depth = kinds_along(by_test, by_trial, mass)
            in_plane = np.outer(along(0, c, d, row), along(1, c, d, column))
            return in_plane[:, :, None, None] * self.depth[depth]

        lam, mu = self.lame
        blocks = [
            [lam * integral(c, c, d, d, "centre") + mu * integral(c, d, d, c, "mass") for d in range(3)]
            for c in range(3)
        ]
        for c in range(3):
            blocks[c][c] += mu * sum(integral(c, by, c, by, "mass") for by in range(3))
        return np.concatenate([np.concatenate(row, axis=-1) for row in blocks], axis=-2)


def _schur_complement(between: _Stiffness, towards: list[Array], answers: list[Array]) -> Array:
    """Stiffness of what freed sides add, the sliding block's unknowns eliminated; its upper triangle."""
    rows, columns, size = answers[0].shape[:3]
    counts = (columns, rows, 1)
    ends = size * np.cumsum((0, *counts))
    schur = np.zeros((ends[-1], ends[-1]))
    for one, other in combinations_with_replacement(range(len(SIDES)), 2):
        through = towards[one].swapaxes(-1, -2) @ answers[other]
        common = tuple(a for a in (0, 1) if SIDES[one][a] is SIDES[other][a] is FREED)
        block = between(SIDES[one], SIDES[other]) - through.sum(axis=common, keepdims=True)
        part = schur[ends[one] : ends[one + 1], ends[other] : ends[other + 1]]
        part = part.reshape(counts[one], size, counts[other], size)  # a view
        place = "".join(sorted({NAMES[one], NAMES[other]}))
        view = np.einsum(f"{NAMES[one]}i{NAMES[other]}j->{place}ij", part)
        view[...] = block.reshape(view.shape)
    return schur


def _held(side: Part, name: str, towards: Array, loaded: Array, forces: list[Array], normal: int) -> Array:
    """(unknowns of a side, loads²) what sliding sides hold there, under a unit force on each load."""
    through = -(towards.swapaxes(-1, -2) @ loaded)[..., 0]
    modes = [force[MODES] for force in forces]
    held = np.einsum(f"pqk,pa,qb->{name.strip('e')}kab", through, *modes, optimize=True)
    held = held.reshape(-1, *held.shape[-3:])
    direct = np.einsum("pa,qb->pqab", *(force[part] for force, part in zip(forces, side, strict=True)))
    held[:, normal] += direct.reshape(held[:, normal].shape)
    return held.reshape(-1, held.shape[-1] * held.shape[-2])


def _greatest(gram: Array, least: float) -> tuple[Array, Array]:
    """Eigenvalues, ascending, of at least `least` of the greatest, and their eigenvectors as columns.

    They are sought in the range of a pivoted Cholesky factor, so that the cost grows with their number.
    """
    tolerance = 0.01 * least * gram.diagonal().max()
    factor, pivots, rank, _ = scipy.linalg.lapack.dpstrf(gram, tol=tolerance, lower=1)
    root = np.empty((gram.shape[0], rank))
    root[pivots - 1] = np.tril(factor[:, :rank])
    values, vectors = scipy.linalg.eigh(root.T @ root)
    kept = values >= least * values[-1]
    return values[kept], root @ (vectors[:, kept] / np.sqrt(values[kept]))


def _strain(
    quarter: Quarter, bases: list[list[Array]], parity: Parity, answers: list[Array], motions: Array
) -> Array:
    """(6 * points², columns) strain at receptor depth under motions (unknowns, columns) that sides add."""
    rows, columns, size = answers[0].shape[:3]
    depth = np.stack([quarter.at_depth(derivative) for derivative in (False, True)])
    read = np.kron(np.eye(3), depth)  # (component, value or slope) of the unknowns of a mode
    ends = size * np.cumsum((columns, rows))
    shapes = (1, columns), (rows, 1), (1, 1)
    moved = [
        each.reshape(*shape, size, -1) for each, shape in zip(np.split(motions, ends), shapes, strict=True)
    ]
    field = np.empty((rows + 1, columns + 1, len(read), motions.shape[1]))
    field[MODES, MODES] = -sum(
        (read @ answer) @ motion for answer, motion in zip(answers, moved, strict=True)
    )
    for side, motion in zip(SIDES, moved, strict=True):
        field[side] = read @ motion

    def derivative(component: int, by: int) -> Array:
        at_depth = field[:, :, 2 * component + (by == 2)]
        row, column = (
            quarter.reading(by == axis, (component == axis) != parity[axis]) @ bases[axis][component]
            for axis in (0, 1)
        )
        return np.einsum("ap,bq,pqr->abr", row, column, at_depth, optimize=True)

    strains = [0.5 * (derivative(a, b) + derivative(b, a)) for a, b in STRAIN_COMPONENTS]
    return np.stack(strains).reshape(-1, motions.shape[1])
