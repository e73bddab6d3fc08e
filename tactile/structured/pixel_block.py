"""Hexahedra with a node of the contact face at every pixel centre, for `tactile.elements.finite_elements`.

Integration is selectively reduced, as in `tactile.structured.block`. On a tensor grid the stiffness is a sum
of Kronecker products of matrices along one axis, so there is no loop over elements. Pixels are centred half a
pitch off the mirror planes, so an element straddles each plane. Under a load that is even or odd about the
plane, the element's far node moves like plus or minus its near node; the far node is a ghost that is folded
back, and a quarter of the block stands for the whole.

Axes are (row, column, depth) as in `tactile.structured.block`. Young's modulus is 1 in the base of the skin.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from operator import add

import numpy as np
import scipy.sparse as sp

from relief.common.arrays import Array
from tactile.elements.condensation import condensed
from tactile.layer.cosine_layer import Parity
from tactile.layer.interpolation import STENCIL, lagrange
from tactile.layer.layers import Stack, levels_within, moduli_of_rows
from tactile.skin import lame
from tactile.strain import STRAIN_COMPONENTS


@dataclass(frozen=True)
class PixelBlock:
    """Mesh of a quarter of the block.

    Attributes:
        half_mm: half the side of the block.
        half: pixels along half a side.
        levels: node depths, from 0 (contact face) to the thickness (bonded face).
        depth_mm: receptor depth.
        poisson_ratio: nu.
        stack: layers above the base, whose modulus is 1; their boundaries are among the levels.
    """

    half_mm: float
    half: int
    levels: Array
    depth_mm: float
    poisson_ratio: float
    stack: Stack = ()

    @property
    def pitch_mm(self) -> float:
        """Side of a pixel."""
        return self.half_mm / self.half

    @property
    def moduli(self) -> Array:
        """(rows,) Young's modulus of each row of elements."""
        return moduli_of_rows(self.levels, self.stack)

    def at_depth(self, derivative: bool) -> Array:
        """(levels - 1,) weights of the value or the slope at the receptors, from the nodes of their layer."""
        weights, here = np.zeros(len(self.levels)), levels_within(self.levels, self.depth_mm, self.stack)
        weights[here] = lagrange(self.levels[here], np.array([self.depth_mm]), derivative)[0]
        # The bonded level does not move, so its column is left out.
        return weights[:-1]

    @property
    def line(self) -> Array:
        """(half + 2,) node positions along an axis: the ghost, the pixel centres, the side."""
        return np.append((np.arange(self.half + 1) - 0.5) * self.pitch_mm, self.half_mm)


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
    advance: Callable[[], object] = lambda: None,
) -> FaceResponse:
    """Condense one parity block onto the contact face.

    Args:
        block: the mesh.
        parity: whether the forces are odd in (row, column).
        loads: (half², loads) forces (N) on the pixels of the quarter, one set for each column of strains.
        portable: use SuperLU even where Pardiso is installed.
        advance: called after either half of the work.
    """
    matrix = folded_stiffness(block, parity)
    face = np.arange((block.half + 1) ** 2) * (len(block.levels) - 1)
    face = 2 * (matrix.shape[0] // 3) + face
    body = condensed(matrix, face, portable=portable)
    spread = _force_of_pixels(block)
    compliance = spread.T @ (spread.T @ body.compliance).T
    advance()
    solution = body.solution(spread @ loads)
    advance()
    return FaceResponse(0.5 * (compliance + compliance.T), _strain_at_depth(block, parity, solution))


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
        left, right = (_fold(block.half, _is_odd(c, axis, parity)) for c in (test, trial))
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


def kinds_along(by_test: int, by_trial: int, mass: str) -> list[str]:
    """Which of `matrices_along` an integral of a product of derivatives takes along each axis.

    Args:
        by_test: axis of the derivative of the test function.
        by_trial: axis of the derivative of the displacement.
        mass: the matrix along axes without a derivative, "mass" or "centre".
    """
    kinds = {(True, True): "slopes", (True, False): "slope_value", (False, True): "value_slope"}
    return [kinds.get((axis == by_test, axis == by_trial), mass) for axis in range(3)]


def _is_odd(component: int, axis: int, parity: Parity) -> bool:
    """Whether a displacement component is odd along an axis."""
    return (component == axis) != parity[axis]


def _fold(half: int, odd: bool) -> sp.csr_matrix:
    """(half + 2, half + 1): the ghost is plus or minus the first pixel."""
    matrix = sp.lil_matrix((half + 2, half + 1))
    matrix[0, 0] = -1.0 if odd else 1.0
    matrix[np.arange(1, half + 2), np.arange(half + 1)] = 1.0
    return matrix.tocsr()


def matrices_along(nodes: Array, weights: Array) -> dict[str, sp.csr_matrix]:
    """One-dimensional integrals of linear hats and their slopes, by name.

    "mass" is exact, "centre" takes the value at the middle of each element; "slopes", "slope_value" and
    "value_slope" are the same by either rule.

    Args:
        nodes: (k,) ascending positions, mm.
        weights: (k - 1,) factor of each element's contribution.
    """
    length = np.diff(nodes)
    locals_ = {
        "mass": length[:, None, None] / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]]),
        "centre": length[:, None, None] / 4.0 * np.ones((2, 2)),
        "slopes": 1.0 / length[:, None, None] * np.array([[1.0, -1.0], [-1.0, 1.0]]),
        "slope_value": np.broadcast_to(0.5 * np.array([[-1.0, -1.0], [1.0, 1.0]]), (length.size, 2, 2)),
    }
    first = np.arange(length.size)
    rows = (first[:, None, None] + np.array([[0, 0], [1, 1]])).ravel()
    columns = (first[:, None, None] + np.array([[0, 1], [0, 1]])).ravel()
    matrices = {
        kind: sp.csr_matrix(((weights[:, None, None] * values).ravel(), (rows, columns)), (nodes.size,) * 2)
        for kind, values in locals_.items()
    }
    matrices["value_slope"] = matrices["slope_value"].T.tocsr()
    return matrices


def _force_of_pixels(block: PixelBlock) -> sp.csr_matrix:
    """((half + 1)², half²): the nodes' shares of the pixels' forces.

    A pixel's force acts at the pixel's centre; of a pixel at the rim, a quarter of the force acts at the
    side, as under uniform pressure.
    """
    line = sp.lil_matrix((block.half + 1, block.half))
    line[np.arange(block.half), np.arange(block.half)] = 1.0
    line[block.half - 1, block.half - 1] = 0.75
    line[block.half, block.half - 1] = 0.25
    return sp.csr_matrix(sp.kron(line, line, format="csr"))


def _strain_at_depth(block: PixelBlock, parity: Parity, solution: Array) -> Array:
    """(6, half², loads) from nodal displacements (unknowns, loads)."""
    side = block.half + 1
    field = solution.reshape(3, side, side, len(block.levels) - 1, -1)
    value, slope = block.at_depth(False), block.at_depth(True)
    at_depth, with_depth = (np.einsum("crzdl,d->crzl", field, w) for w in (value, slope))

    def derivative(component: int, by: int) -> Array:
        if by == 2:
            return with_depth[component][:-1, :-1]
        operator = _slope_at_pixels(block, _is_odd(component, by, parity))
        if by == 0:
            return np.einsum("pr,rzl->pzl", operator, at_depth[component][:, :-1])
        return np.einsum("pz,rzl->rpl", operator, at_depth[component][:-1])

    strains = [0.5 * (derivative(a, b) + derivative(b, a)) for a, b in STRAIN_COMPONENTS]
    return np.stack(strains).reshape(6, block.half**2, -1)


def _slope_at_pixels(block: PixelBlock, odd: bool) -> Array:
    """(half, half + 1): derivative along an axis at the pixel centres."""
    mirrored = STENCIL // 2
    inner = block.line[1:]
    extended = np.concatenate((-inner[:mirrored][::-1], inner))
    full = lagrange(extended, inner[:-1], True)
    result = full[:, mirrored:].copy()
    result[:, :mirrored] += (-1.0 if odd else 1.0) * full[:, mirrored - 1 :: -1][:, :mirrored]
    return result
