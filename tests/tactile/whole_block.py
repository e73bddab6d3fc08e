"""The skin block as a whole, assembled element by element in scikit-fem, to check a folded quarter."""

from typing import Literal

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.helpers import ddot, div, sym_grad

from tactile.layer.cosine_layer import PARITIES, Parity
from tactile.skin import lame
from tactile.structured.pixel_block import PixelBlock

CENTRE = (np.full((3, 1), 0.5), np.ones(1))
"""Points and weights of the quadrature with one point at the centre of a hexahedron."""
Volumetric = Literal["one point", "eight points"]
"""Quadrature of the volumetric part of a hexahedron: at one point it does not lock, at eight it does."""

PARITY_NAMES = {
    parity: " ".join("odd" if odd else "even" for odd in parity) for parity in PARITIES
}  # what pytest calls them


def whole_basis(block: PixelBlock) -> skfem.Basis:
    """Trilinear displacements on the whole block: nodes at every pixel centre and on the sides."""
    outward = block.line[1:]
    line = np.concatenate((-outward[::-1], outward))
    mesh = skfem.MeshHex.init_tensor(line, line, block.levels)
    return skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=3)


def whole_stiffness(block: PixelBlock, volumetric: Volumetric = "one point") -> sp.csr_matrix:
    """Stiffness of the whole block, the bonded face still free; unit Young's modulus of the base."""
    lam, mu = lame(1.0, block.poisson_ratio)
    eight_points = whole_basis(block)
    one_point = skfem.Basis(eight_points.mesh, eight_points.elem, quadrature=CENTRE)
    faces, moduli = np.cumsum([h for h, _ in block.stack]), [*(modulus for _, modulus in block.stack), 1.0]

    def modulus(w: skfem.assembly.form.form.FormExtraParams) -> np.ndarray:
        return np.take(moduli, np.searchsorted(faces, w.x[2]))

    dilation = skfem.BilinearForm(lambda u, v, w: modulus(w) * lam * div(u) * div(v))
    shear = skfem.BilinearForm(lambda u, v, w: modulus(w) * 2.0 * mu * ddot(sym_grad(u), sym_grad(v)))
    volume = dilation.assemble(one_point if volumetric == "one point" else eight_points)
    return sp.csr_matrix(volume + shear.assemble(eight_points))


def mirrored(block: PixelBlock, parity: Parity) -> sp.csr_matrix:
    """(unknowns of the whole, unknowns of a quarter): a quarter's displacements and their mirror images.

    A mirror turns the sign of the displacement across it, and an odd load turns it once more.
    """
    basis = whole_basis(block)
    side, layers = block.half + 1, len(block.levels) - 1
    row, column = (np.searchsorted(block.line[1:], np.abs(x) - 1e-9) for x in basis.mesh.p[:2])
    depth = np.searchsorted(block.levels, basis.mesh.p[2] - 1e-9)
    moving = np.flatnonzero(depth < layers)
    number = (row * side + column) * layers + depth
    rows, columns, signs = [], [], []
    for component in range(3):
        sign = np.ones(moving.size)
        for axis, odd in enumerate(parity):
            turned = (component == axis) != odd
            sign[basis.mesh.p[axis, moving] < 0.0] *= -1.0 if turned else 1.0
        rows.append(basis.nodal_dofs[component, moving])
        columns.append(component * side**2 * layers + number[moving])
        signs.append(sign)
    entries = (np.concatenate(signs), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_matrix(sp.coo_matrix(entries, shape=(basis.N, 3 * side**2 * layers)))
