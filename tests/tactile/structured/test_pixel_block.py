"""A quarter of the block, folded at its mirror planes, is the whole block; its fields are exact where due."""

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse.linalg as spla
import skfem

from tactile.layer.cosine_layer import PARITIES, Parity
from tactile.layer.skin_layers import Stack
from tactile.skin import lame
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.pixel_block import PixelBlock
from tests.tactile.folded_block import face_response, folded_stiffness, strain_at_depth
from tests.tactile.whole_block import PARITY_NAMES, mirrored, whole_basis, whole_stiffness

THICKNESS = 2.5
BLOCK = PixelBlock(5.0, 3, np.array([0.0, 0.3, 0.8, 1.6, THICKNESS]), 0.75, 0.48)
SIDE, LAYERS = BLOCK.half + 1, len(BLOCK.levels) - 1
EVERY_PARITY = pytest.mark.parametrize("parity", PARITIES, ids=PARITY_NAMES.get)

EVEN, ODD_ROW, ODD_COLUMN, ODD = (False, False), (True, False), (False, True), (True, True)
Motion = Callable[[np.ndarray, np.ndarray, np.ndarray], tuple]
"""From row, column and depth coordinates to the three displacements."""
RIGID: dict[str, tuple[Parity, Motion]] = {
    "shift along rows": (ODD_ROW, lambda x, y, z: (1.0, 0.0, 0.0)),
    "shift along columns": (ODD_COLUMN, lambda x, y, z: (0.0, 1.0, 0.0)),
    "shift in depth": (EVEN, lambda x, y, z: (0.0, 0.0, 1.0)),
    "turn about rows": (ODD_COLUMN, lambda x, y, z: (0.0, z, -y)),
    "turn about columns": (ODD_ROW, lambda x, y, z: (z, 0.0, -x)),
    "turn about depth": (ODD, lambda x, y, z: (y, -x, 0.0)),
}
STRETCHED: dict[str, tuple[Parity, Motion]] = {
    "stretch along rows": (EVEN, lambda x, y, z: (x, 0.0, 0.0)),
    "stretch along columns": (EVEN, lambda x, y, z: (0.0, y, 0.0)),
    "stretch in depth": (EVEN, lambda x, y, z: (0.0, 0.0, z)),
    "shear of columns and depth": (ODD_COLUMN, lambda x, y, z: (0.0, z, y)),
    "shear of rows and depth": (ODD_ROW, lambda x, y, z: (z, 0.0, x)),
    "shear of rows and columns": (ODD, lambda x, y, z: (y, x, 0.0)),
}
BONDED: dict[str, tuple[Parity, Motion]] = {
    "squeeze": (EVEN, lambda x, y, z: (0.0, 0.0, THICKNESS - z)),
    "shear along rows": (ODD_ROW, lambda x, y, z: (THICKNESS - z, 0.0, 0.0)),
    "shear along columns": (ODD_COLUMN, lambda x, y, z: (0.0, THICKNESS - z, 0.0)),
}


def nodal(motion: Motion, block: PixelBlock = BLOCK) -> np.ndarray:
    """(3, row, column, depth) displacements of the nodes that move."""
    grid = np.meshgrid(block.line[1:], block.line[1:], block.levels[:-1], indexing="ij")
    return np.stack([np.broadcast_to(u, grid[0].shape) for u in motion(*grid)])


@EVERY_PARITY
@pytest.mark.parametrize("stack", [(), ((0.3, 4.0), (0.5, 0.1))], ids=["one layer", "three layers"])
@pytest.mark.parametrize("nu", [0.0, 0.48, 0.499])
def test_a_folded_quarter_stores_a_quarter_of_the_whole_blocks_energy(
    parity: Parity, nu: float, stack: Stack
) -> None:
    block = PixelBlock(BLOCK.half_mm, BLOCK.half, BLOCK.levels, BLOCK.depth_mm, nu, stack)
    image = mirrored(block, parity)
    expected = (image.T @ whole_stiffness(block) @ image).toarray() / 4.0
    stiffness = folded_stiffness(block, parity).toarray()
    np.testing.assert_allclose(stiffness, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@EVERY_PARITY
def test_stiffness_is_symmetric_and_positive_definite(parity: Parity) -> None:
    stiffness = folded_stiffness(BLOCK, parity).toarray()
    assert stiffness.shape == (3 * (BLOCK.half + 1) ** 2 * (len(BLOCK.levels) - 1),) * 2
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=0.0, atol=1e-14 * np.abs(stiffness).max())
    assert np.linalg.eigvalsh(stiffness)[0] > 0.0


@pytest.mark.parametrize("name", RIGID)
def test_a_rigid_motion_takes_no_force(name: str) -> None:
    """But at the layer next to the bone, which holds it back."""
    parity, motion = RIGID[name]
    force = (folded_stiffness(BLOCK, parity) @ nodal(motion).ravel()).reshape(3, SIDE, SIDE, LAYERS)
    np.testing.assert_allclose(force[..., :-1], 0.0, atol=1e-13 * np.abs(force).max())


@pytest.mark.parametrize("name", STRETCHED)
def test_constant_strain_is_in_equilibrium_on_uneven_elements(name: str) -> None:
    """The patch test, at every node off the block's faces; those next to the mirror planes are among them."""
    parity, motion = STRETCHED[name]
    force = (folded_stiffness(BLOCK, parity) @ nodal(motion).ravel()).reshape(3, SIDE, SIDE, LAYERS)
    inside = force[:, :-1, :-1, 1:-1]
    np.testing.assert_allclose(inside, 0.0, atol=1e-13 * np.abs(force).max())


@pytest.mark.parametrize("name", BONDED)
def test_a_linear_field_on_the_boundary_is_continued_inside(name: str) -> None:
    parity, motion = BONDED[name]
    stiffness, exact = folded_stiffness(BLOCK, parity), nodal(motion).ravel()
    inner = np.zeros((3, SIDE, SIDE, LAYERS), dtype=bool)
    inner[:, :-1, :-1, 1:] = True
    inside, boundary = np.flatnonzero(inner), np.flatnonzero(~inner)
    boundary_load = stiffness[np.ix_(inside, boundary)] @ exact[boundary]
    solution = spla.spsolve(stiffness[np.ix_(inside, inside)].tocsc(), -boundary_load)
    np.testing.assert_allclose(solution, exact[inside], atol=1e-12)


@pytest.mark.parametrize("name", BONDED)
def test_a_linear_field_stores_its_energy(name: str) -> None:
    parity, motion = BONDED[name]
    lam, mu = lame(1.0, BLOCK.poisson_ratio)
    displacement = nodal(motion).ravel()
    modulus = lam + 2.0 * mu if name == "squeeze" else mu
    stored = 0.5 * displacement @ folded_stiffness(BLOCK, parity) @ displacement
    assert stored == pytest.approx(0.5 * modulus * BLOCK.half_mm**2 * THICKNESS, rel=1e-12)


@EVERY_PARITY
def test_strain_of_a_quartic_field_is_exact(parity: Parity) -> None:
    """Five nodes along each axis, mirror images among them, carry a polynomial of the fourth degree."""
    block = PixelBlock(5.0, 6, np.array([0.0, 0.2, 0.5, 0.9, 1.3, 1.9, THICKNESS]), 0.75, 0.3)
    random = np.random.default_rng(0)
    along = random.uniform(-1.0, 1.0, (3, 3, 5))
    for component in range(3):
        for axis in (0, 1):
            odd = (component == axis) != parity[axis]
            along[component, axis, int(not odd) :: 2] = 0.0
    factors = [[np.polynomial.Polynomial(along[c, a]) for a in range(3)] for c in range(3)]
    bonded = np.polynomial.Polynomial([THICKNESS, -1.0])
    for c in range(3):
        factors[c][2] = bonded * np.polynomial.Polynomial(along[c, 2, :4])

    def value(c: int, by: int | None, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        rows, columns, depths = (f.deriv() if axis == by else f for axis, f in enumerate(factors[c]))
        return rows(x) * columns(y) * depths(z)

    field = nodal(lambda x, y, z: tuple(value(c, None, x, y, z) for c in range(3)), block)
    strain = strain_at_depth(block, parity, field.reshape(-1, 1))[..., 0].reshape(6, 6, 6)
    pixels = block.line[1:-1]
    place = np.meshgrid(pixels, pixels, block.depth_mm, indexing="ij")
    expected = np.stack(
        [0.5 * (value(a, b, *place) + value(b, a, *place))[..., 0] for a, b in STRAIN_COMPONENTS]
    )
    np.testing.assert_allclose(strain, expected, rtol=0.0, atol=1e-11 * np.abs(expected).max())


def test_equal_pixel_forces_are_uniform_pressure() -> None:
    basis = whole_basis(BLOCK)
    face = skfem.FacetBasis(
        basis.mesh,
        basis.elem,
        facets=basis.mesh.facets_satisfying(lambda x: np.isclose(x[2], 0.0)),
        intorder=3,
    )
    uniform = skfem.LinearForm(lambda v, _: v[2]).assemble(face)
    quarter = (mirrored(BLOCK, EVEN).T @ uniform / 4.0).reshape(3, SIDE**2, LAYERS)[2, :, 0]
    forces = np.kron(BLOCK.shares, BLOCK.shares) @ np.full(BLOCK.half**2, BLOCK.pitch_mm**2)
    np.testing.assert_allclose(forces, quarter, atol=1e-13)


@EVERY_PARITY
def test_compliance_of_the_face_is_symmetric_and_positive(parity: Parity) -> None:
    compliance = face_response(BLOCK, parity, np.zeros((BLOCK.half**2, 1))).compliance
    np.testing.assert_array_equal(compliance, compliance.T)
    assert np.linalg.eigvalsh(compliance)[0] > 0.0


def test_exchanging_rows_and_columns_exchanges_the_mixed_parities() -> None:
    load = np.random.default_rng(0).normal(size=(BLOCK.half, BLOCK.half))
    one = face_response(BLOCK, ODD_COLUMN, load.reshape(-1, 1))
    other = face_response(BLOCK, ODD_ROW, load.T.reshape(-1, 1))
    grid = (BLOCK.half,) * 4
    turned = other.compliance.reshape(grid).transpose(1, 0, 3, 2).reshape(one.compliance.shape)
    np.testing.assert_allclose(one.compliance, turned, atol=1e-12 * np.abs(turned).max())
    strain, image = (r.strain.reshape(6, BLOCK.half, BLOCK.half) for r in (one, other))
    expected = image.transpose(0, 2, 1)[[1, 0, 2, 4, 3, 5]]
    np.testing.assert_allclose(strain, expected, atol=1e-12 * np.abs(expected).max())


@EVERY_PARITY
def test_superlu_gives_the_response_that_pardiso_gives(parity: Parity) -> None:
    loads = np.random.default_rng(0).normal(size=(BLOCK.half**2, 4))
    fast, portable = (face_response(BLOCK, parity, loads, portable=p) for p in (False, True))
    for one, other in ((fast.compliance, portable.compliance), (fast.strain, portable.strain)):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-10 * np.abs(other).max())
