"""The block of `tactile.structured.pixel_block` by factorisation of a folded quarter, to check the modes."""

from dataclasses import dataclass
from functools import partial, reduce
from operator import add

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array
from tactile.elements.condensation import condensed_onto_loads
from tactile.layer.cosine_layer import Parity
from tactile.skin import lame
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.along_axes import fold, kinds_along, matrices_along
from tactile.structured.pixel_block import PixelBlock


@dataclass(frozen=True)
class FaceResponse:
    """Response of one parity block to normal forces on the pixels of its quarter of the contact face.

    Attributes:
        compliance: (half², half²) normal displacement of each pixel, mm/N at E = 1 MPa; pixels row-major,
            from the mirror planes outward.
        strain: (6, half², loads) strains at receptor depth under the given loads.
    """

    compliance: Array
    strain: Array


def face_response(
    block: PixelBlock,
    parity: Parity,
    loads: Array,
    *,
    portable: bool = False,
) -> FaceResponse:
    """Condense one parity block onto the contact face.

    Args:
        block: the mesh.
        parity: whether the forces are odd in (row, column).
        loads: (half², loads) forces (N) on the pixels of the quarter, one set for each column of strains.
        portable: use SuperLU even where Pardiso is installed.
    """
    matrix = folded_stiffness(block, parity)
    spread = sp.csr_matrix((matrix.shape[0], block.half**2)).tolil()
    face = 2 * (matrix.shape[0] // 3) + np.arange((block.half + 1) ** 2) * (len(block.levels) - 1)
    spread[face] = np.kron(block.shares, block.shares)
    body = condensed_onto_loads(matrix, spread.tocsr(), portable=portable)
    return FaceResponse(body.compliance, strain_at_depth(block, parity, body.solution(loads)))


def folded_stiffness(block: PixelBlock, parity: Parity) -> sp.csr_matrix:
    """Stiffness of a quarter; its unknowns are (component, row, column, depth) without the bonded level."""
    lam, mu = lame(1.0, block.poisson_ratio)
    # A straddling element belongs to either side in equal parts.
    weights = np.ones(block.half + 1)
    weights[0] = 0.5
    plane = matrices_along(block.line, weights)
    depth = matrices_along(block.levels, block.moduli)
    bonded = sp.identity(len(block.levels), format="csr")[:, :-1]

    def along(axis: int, test: int, trial: int, kind: str) -> sp.csr_matrix:
        if axis == 2:
            return sp.csr_matrix(bonded.T @ depth[kind] @ bonded)
        left, right = (fold(block.half, _is_odd(c, axis, parity)) for c in (test, trial))
        return sp.csr_matrix(left.T @ plane[kind] @ right)

    def integral(test: int, by_test: int, trial: int, by_trial: int, mass: str) -> sp.csr_matrix:
        """Integral of d(test component)/d(by_test) times d(trial component)/d(by_trial)."""
        kinds = enumerate(kinds_along(by_test, by_trial, mass))
        factors = (along(axis, test, trial, kind) for axis, kind in kinds)
        return sp.csr_matrix(reduce(partial(sp.kron, format="csr"), factors))

    blocks = [[sp.csr_matrix((0, 0))] * 3 for _ in range(3)]
    for c in range(3):
        for d in range(c, 3):
            entry = lam * integral(c, c, d, d, "centre") + mu * integral(c, d, d, c, "mass")
            if c == d:
                entry = entry + mu * reduce(add, (integral(c, a, c, a, "mass") for a in range(3)))
            blocks[c][d] = entry
            if c != d:
                blocks[d][c] = entry.T
    return sp.csr_matrix(sp.bmat(blocks, format="csr"))


def _is_odd(component: int, axis: int, parity: Parity) -> bool:
    """Whether a displacement component is odd along an axis."""
    return (component == axis) != parity[axis]


def strain_at_depth(block: PixelBlock, parity: Parity, solution: Array) -> Array:
    """(6, half², loads) from nodal displacements (unknowns, loads)."""
    side = block.half + 1
    field = solution.reshape(3, side, side, len(block.levels) - 1, -1)
    value, slope = block.at_depth(False), block.at_depth(True)
    at_depth, with_depth = (np.einsum("crzdl,d->crzl", field, w) for w in (value, slope))

    def derivative(component: int, by: int) -> Array:
        if by == 2:
            return with_depth[component][:-1, :-1]
        operator = block.reading(True, _is_odd(component, by, parity))
        if by == 0:
            return np.einsum("pr,rzl->pzl", operator, at_depth[component][:, :-1])
        return np.einsum("pz,rzl->rpl", operator, at_depth[component][:-1])

    strains = [0.5 * (derivative(a, b) + derivative(b, a)) for a, b in STRAIN_COMPONENTS]
    return np.stack(strains).reshape(6, block.half**2, -1)
