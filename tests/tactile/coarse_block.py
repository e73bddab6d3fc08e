"""The block of `tactile.structured.block` by scikit-fem and a factorisation, to check the modes.

Two mirror planes split the block
into four parity blocks, each a quarter with its own conditions on the mirror planes: a load even in x leaves
u_x = 0 on the plane x = 0, an odd one leaves u_y = u_z = 0. Integration is selectively reduced: the
volumetric part at one point, the rest at eight, because plain trilinear elements lock at nu = 0.48.

Axes are (row, column, depth); depth runs from the contact face (0) to the bonded face. Young's modulus is 1
in the base of the skin.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.helpers import ddot, div, sym_grad

from relief.ground.arrays import Array
from tactile.layer.cosine_layer import Parity
from tactile.layer.skin_layers import moduli_of_rows, row_weights
from tactile.skin import Skin, lame
from tactile.sparse import factorised
from tactile.strain import STRAIN_COMPONENTS
from tests.tactile.whole_block import CENTRE

Sides = Literal["free", "sliding"]
"""Condition on the four sides: no traction, or neither normal displacement nor shear."""


@dataclass(frozen=True)
class QuarterResponse:
    """Response of one parity block to unit normal forces on the nodes of its quarter of the contact face.

    Attributes:
        displacement: (nodes, nodes) normal displacement of the contact face, mm/N at E = 1 MPa; nodes
            row-major, from the mirror planes outward, `quarter + 1` along each axis.
        strain: (6, elements, nodes) strains at the element centres at receptor depth, elements row-major.
    """

    displacement: Array
    strain: Array


def quarter_responses(
    half_mm: float, quarter: int, levels: Array, skin: Skin, sides: Sides
) -> dict[Parity, QuarterResponse]:
    """Responses of the four parity blocks.

    Args:
        half_mm: half the side of the block.
        quarter: elements along half a side.
        levels: node depths, from 0 to the thickness, among them the boundaries of the skin's layers.
        skin: all but force and modulus matters here.
        sides: "free" (no traction) or "sliding" (no normal displacement, no shear).
    """
    line = np.linspace(0.0, half_mm, quarter + 1)
    mesh = skfem.MeshHex.init_tensor(line, line, levels)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    stiffness = _stiffness(mesh, levels, skin)

    row, column, depth = mesh.p
    dofs = basis.nodal_dofs  # (3, nodes)
    face = np.flatnonzero(np.isclose(depth, 0.0))
    face = face[np.lexsort((column[face], row[face]))]
    centres = 0.5 * (levels[1:] + levels[:-1])
    strain_operator = sum(
        weight * _strain_at_depth(basis, centres[row])
        for row, weight in row_weights(levels, skin.depth_mm, skin.stack)
    )

    responses: dict[Parity, QuarterResponse] = {}
    for parity in ((False, False), (False, True), (True, True)):
        fixed = [dofs[:, np.isclose(depth, levels[-1])].ravel()]
        for axis, (position, odd) in enumerate(zip((row, column), parity, strict=True)):
            mirror = np.isclose(position, 0.0)
            held = np.flatnonzero((np.arange(3) != axis) == odd)
            fixed.append(dofs[np.ix_(held, np.flatnonzero(mirror))].ravel())
            if sides == "sliding":
                fixed.append(dofs[axis, np.isclose(position, half_mm)])
        free = np.setdiff1d(np.arange(basis.N), np.concatenate(fixed))
        number = np.full(basis.N, -1)
        number[free] = np.arange(free.size)
        loaded = number[dofs[2, face]]
        present = np.flatnonzero(loaded >= 0)

        forces = np.zeros((free.size, face.size))
        forces[loaded[present], present] = 1.0
        solution = factorised(stiffness[np.ix_(free, free)])(forces)
        surface = np.zeros((face.size, face.size))
        surface[present] = solution[loaded[present]]
        strains = strain_operator[:, free] @ solution
        responses[parity] = QuarterResponse(surface, strains.reshape(6, quarter**2, face.size))
    responses[True, False] = _transposed(responses[False, True], quarter)
    return responses


def _stiffness(mesh: skfem.MeshHex, levels: Array, skin: Skin) -> sp.csr_matrix:
    lam, mu = lame(1.0, skin.poisson_ratio)
    row = np.searchsorted(levels, mesh.p[2, mesh.t].mean(axis=0)) - 1
    moduli = moduli_of_rows(levels, skin.stack)[row]

    @skfem.BilinearForm
    def volumetric(u, v, w):
        return w.modulus * (lam * div(u) * div(v))

    @skfem.BilinearForm
    def shear(u, v, w):
        return w.modulus * (2.0 * mu * ddot(sym_grad(u), sym_grad(v)))

    element = skfem.ElementVector(skfem.ElementHex1())
    # With intorder=1 scikit-fem takes eight points as well, so the one point is written out.
    one_point = skfem.Basis(mesh, element, quadrature=CENTRE)
    eight_points = skfem.Basis(mesh, element, intorder=3)
    one, eight = (np.repeat(moduli[:, None], basis.X.shape[-1], 1) for basis in (one_point, eight_points))
    return sp.csr_matrix(
        volumetric.assemble(one_point, modulus=one) + shear.assemble(eight_points, modulus=eight)
    )


def _strain_at_depth(basis: skfem.Basis, depth_mm: float) -> sp.csr_matrix:
    """(6 * elements, unknowns): strains at the centres of the row of elements centred at a depth."""
    mesh = basis.mesh
    centres = mesh.p[:, mesh.t].mean(axis=1)
    here = np.flatnonzero(np.isclose(centres[2], depth_mm))
    here = here[np.lexsort((centres[1][here], centres[0][here]))]
    centre = skfem.Basis(mesh, basis.elem, quadrature=CENTRE, elements=here)
    rows, columns, values = [], [], []
    for local in range(basis.Nbfun):
        field = centre.basis[local][0]
        gradient = field.grad[..., 0]  # (component, derivative, elements)
        for number, (a, b) in enumerate(STRAIN_COMPONENTS):
            rows.append(number * here.size + np.arange(here.size))
            columns.append(basis.element_dofs[local, here])
            values.append(0.5 * (gradient[a, b] + gradient[b, a]))
    shape = (6 * here.size, basis.N)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_matrix(entries, shape=shape)


def _transposed(response: QuarterResponse, quarter: int) -> QuarterResponse:
    """The same block with rows and columns exchanged."""
    n, m = quarter + 1, quarter
    displacement = response.displacement.reshape(n, n, n, n).transpose(1, 0, 3, 2).reshape(n * n, n * n)
    strain = response.strain.reshape(6, m, m, n, n).transpose(0, 2, 1, 4, 3).reshape(6, m * m, n * n)
    return QuarterResponse(displacement, strain[[1, 0, 2, 4, 3, 5]])
