"""The finite elements of the block: exact where they must be, symmetric, and the parities make a whole."""

import numpy as np
import pytest
import skfem

from tactile.layer.cosine_layer import PARITIES
from tactile.skin import Skin, lame
from tactile.sparse import factorised, has_pardiso
from tactile.strain import STRAIN_COMPONENTS
from tactile.structured.block import depth_levels
from tests.tactile.coarse_block import Sides, _stiffness, _strain_at_depth, quarter_responses

HALF, QUARTER, SKIN = 5.0, 3, Skin()
THICKNESS, DEPTH = SKIN.thickness_mm, SKIN.depth_mm
LEVELS = depth_levels(DEPTH, THICKNESS, 0.5)
NODES = QUARTER + 1
SIDES = pytest.mark.parametrize("sides", ["free", "sliding"])


def uniform_forces(quarter: int) -> np.ndarray:
    """Nodal forces of unit pressure on a quarter of the face."""
    weight = np.full(quarter + 1, HALF / quarter)
    weight[[0, -1]] *= 0.5
    return np.outer(weight, weight).ravel()


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.48, 0.499])
def test_uniform_pressure_between_sliding_sides_is_exact(nu: float) -> None:
    lam, mu = lame(1.0, nu)
    even = quarter_responses(HALF, QUARTER, LEVELS, Skin(poisson_ratio=nu), "sliding")[False, False]
    forces = uniform_forces(QUARTER)
    np.testing.assert_allclose(even.displacement @ forces, THICKNESS / (lam + 2.0 * mu), rtol=1e-10)
    strain = even.strain @ forces
    expected = np.zeros_like(strain)
    expected[STRAIN_COMPONENTS.index((2, 2))] = -1.0 / (lam + 2.0 * mu)
    np.testing.assert_allclose(strain, expected, atol=1e-10)


@SIDES
def test_compliance_of_every_parity_is_symmetric_and_positive(sides: Sides) -> None:
    for (odd_row, odd_column), response in quarter_responses(HALF, QUARTER, LEVELS, SKIN, sides).items():
        compliance = response.displacement
        np.testing.assert_allclose(compliance, compliance.T, atol=1e-12 * np.abs(compliance).max())
        grid = np.ones((NODES, NODES), dtype=bool)
        grid[0, :] &= not odd_row
        grid[:, 0] &= not odd_column
        moving = np.flatnonzero(grid)
        assert np.linalg.eigvalsh(compliance[np.ix_(moving, moving)]).min() > 0.0
        held = np.flatnonzero(~grid)
        assert not compliance[held].any() and not compliance[:, held].any()


def test_parities_together_are_the_whole_block() -> None:
    line = np.linspace(-HALF, HALF, 2 * QUARTER + 1)
    mesh = skfem.MeshHex.init_tensor(line, line, LEVELS)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()), intorder=2)
    row, column, depth = mesh.p
    free = np.setdiff1d(np.arange(basis.N), basis.nodal_dofs[:, np.isclose(depth, THICKNESS)].ravel())
    face = np.flatnonzero(np.isclose(depth, 0.0))
    face = face[np.lexsort((column[face], row[face]))]
    place = (QUARTER + 1, QUARTER + 2)  # in rows and columns from the mirror planes: 1, 2
    force = np.zeros(basis.N)
    force[basis.nodal_dofs[2, face.reshape(2 * QUARTER + 1, -1)[place]]] = 1.0
    whole = np.zeros(basis.N)
    whole[free] = factorised(_stiffness(mesh, LEVELS, SKIN)[np.ix_(free, free)])(force[free])
    surface = whole[basis.nodal_dofs[2, face]].reshape(2 * QUARTER + 1, -1)
    strain = (_strain_at_depth(basis, DEPTH) @ whole).reshape(6, 2 * QUARTER, 2 * QUARTER)

    responses = quarter_responses(HALF, QUARTER, LEVELS, SKIN, "free")
    source = 1 * NODES + 2
    for mirror_row, mirror_column in PARITIES:  # the four quadrants
        expected_surface = np.zeros((NODES, NODES))
        expected_strain = np.zeros((6, QUARTER, QUARTER))
        for (odd_row, odd_column), response in responses.items():
            sign = (-1) ** (odd_row * mirror_row + odd_column * mirror_column)
            expected_surface += 0.25 * sign * response.displacement[:, source].reshape(NODES, NODES)
            for number, pair in enumerate(STRAIN_COMPONENTS):
                turned = (-1) ** (pair.count(0) * mirror_row + pair.count(1) * mirror_column)
                part = response.strain[number, :, source].reshape(QUARTER, QUARTER)
                expected_strain[number] += 0.25 * sign * turned * part
        rows = slice(QUARTER, None, -1) if mirror_row else slice(QUARTER, None)
        columns = slice(QUARTER, None, -1) if mirror_column else slice(QUARTER, None)
        np.testing.assert_allclose(surface[rows, columns], expected_surface, atol=1e-12)
        rows = slice(QUARTER - 1, None, -1) if mirror_row else slice(QUARTER, None)
        columns = slice(QUARTER - 1, None, -1) if mirror_column else slice(QUARTER, None)
        np.testing.assert_allclose(strain[:, rows, columns], expected_strain, atol=1e-12)


@pytest.mark.parametrize(("nu", "approach"), [(0.48, 0.633), (0.495, 0.603)])
def test_a_flat_plate_squeezes_the_block_without_locking(nu: float, approach: float) -> None:
    """A 64 x 64 mesh gives these; of plain trilinear elements, 0.605 and 0.516 mm. E = 0.25 MPa, 10 N."""
    levels = depth_levels(DEPTH, THICKNESS, 0.18)
    even = quarter_responses(HALF, 8, levels, Skin(poisson_ratio=nu), "free")[False, False]
    stiffness = np.linalg.inv(even.displacement).sum()
    assert 2.5 / stiffness / 0.25 == pytest.approx(approach, rel=0.01)


def test_superlu_gives_what_pardiso_gives_in_either_order() -> None:
    if not has_pardiso():
        pytest.skip("pypardiso is not installed")
    line = np.linspace(0.0, HALF, QUARTER + 1)
    mesh = skfem.MeshHex.init_tensor(line, line, LEVELS)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex1()))
    bonded = basis.nodal_dofs[:, np.isclose(mesh.p[2], THICKNESS)].ravel()
    free = np.setdiff1d(np.arange(basis.N), bonded)
    matrix = _stiffness(mesh, LEVELS, SKIN)[np.ix_(free, free)]
    loads = np.random.default_rng(0).normal(size=(free.size, 3))
    for load in (loads, loads[:, 0]):
        portable = factorised(matrix, portable=True)(load)
        for minimum_degree in (False, True):
            fast = factorised(matrix, minimum_degree=minimum_degree)(load)
            assert fast.shape == portable.shape == load.shape
            np.testing.assert_allclose(fast, portable, atol=1e-9 * np.abs(portable).max())


def test_receptors_lie_at_the_centre_of_a_layer_wherever_they_are() -> None:
    random = np.random.default_rng(0)
    for _ in range(2000):
        thickness = random.uniform(0.2, 6.0)
        depth = thickness * random.uniform(0.02, 0.99)
        levels = depth_levels(depth, thickness, 0.27)
        assert levels[0] == 0.0
        assert levels[-1] == pytest.approx(thickness)
        assert np.isclose(0.5 * (levels[1:] + levels[:-1]), depth).any()
        layers = np.diff(levels)
        assert layers.min() > 0.0 and layers.max() < 0.27 * (1.0 + 1e-9)
