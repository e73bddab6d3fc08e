"""The block's finite elements converge at their rates on manufactured fields, and do not lock."""

from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp

from tactile.elements.condensation import condensed_onto_loads
from tactile.layer.cosine_layer import Parity
from tactile.structured.pixel_block import PixelBlock
from tests.physics.manufactured_block import compressible, errors, isochoric
from tests.tactile.folded_block import folded_stiffness
from tests.tactile.whole_block import PARITY_NAMES, mirrored, whole_stiffness

SIZE, THICKNESS, DEPTH = 10.0, 2.5, 0.75
FIELDS = {"compressible": compressible, "isochoric": isochoric}
EVEN: Parity = (False, False)
RATIOS = pytest.mark.parametrize("nu", [0.3, 0.48, 0.495])
EVERY_PARITY = pytest.mark.parametrize("parity", [EVEN, (False, True), (True, True)], ids=PARITY_NAMES.get)


def uniform_block(half: int, nu: float) -> PixelBlock:
    return PixelBlock(SIZE / 2.0, half, np.linspace(0.0, THICKNESS, half + 1), DEPTH, nu)


@cache
def measured(field: str, half: int, nu: float, parity: Parity) -> tuple[float, float]:
    block = uniform_block(half, nu)
    manufactured = FIELDS[field](parity, THICKNESS, nu)
    return errors(block, parity, manufactured, folded_stiffness(block, parity))


@pytest.mark.parametrize("field", FIELDS)
@RATIOS
@EVERY_PARITY
def test_displacement_and_strain_converge_quadratically(field: str, nu: float, parity: Parity) -> None:
    """Halving the elements quarters both errors: 1.8 to 2.5 of 2 are measured on meshes this small."""
    coarse, fine = (np.array(measured(field, half, nu, parity)) for half in (4, 8))
    assert np.log2(coarse / fine).min() > 1.8


@EVERY_PARITY
def test_incompressibility_costs_an_isochoric_field_no_accuracy(parity: Parity) -> None:
    compliant, stiff = (np.array(measured("isochoric", 8, nu, parity)) for nu in (0.3, 0.499))
    np.testing.assert_allclose(stiff, compliant, rtol=0.05)
    assert stiff.max() < 0.02


def test_elements_integrated_in_full_lose_it() -> None:
    """At nu = 0.495 they are twelve times as far off."""
    block = uniform_block(8, 0.495)
    image = mirrored(block, EVEN)
    full = image.T @ whole_stiffness(block, "eight points") @ image / 4.0
    displacement, strain = errors(block, EVEN, isochoric(EVEN, THICKNESS, 0.495), full)
    assert displacement > 8.0 * measured("isochoric", 8, 0.495, EVEN)[0]
    assert strain > 8.0 * measured("isochoric", 8, 0.495, EVEN)[1]


@pytest.mark.parametrize(("nu", "approach", "locked"), [(0.48, 0.634, 0.610), (0.495, 0.603, 0.538)])
def test_a_flat_plate_goes_as_deep_as_a_fine_mesh_says(nu: float, approach: float, locked: float) -> None:
    """Elements integrated in full stop short. 16 x 16 pixels, E = 0.25 MPa, 10 N."""
    block = uniform_block(8, nu)
    image = mirrored(block, EVEN)
    full = image.T @ whole_stiffness(block, "eight points") @ image / 4.0
    layers, nodes = len(block.levels) - 1, (block.half + 1) ** 2
    face = 2 * (image.shape[1] // 3) + layers * np.arange(nodes)
    forces = sp.csr_matrix((np.ones(nodes), (face, np.arange(nodes))), shape=(image.shape[1], nodes))
    depths = []
    for stiffness in (folded_stiffness(block, EVEN), full.tocsr()):
        resistance = (
            4.0 * np.linalg.inv(condensed_onto_loads(stiffness, forces).compliance).sum()
        )  # N/mm, four quarters
        depths.append(10.0 / 0.25 / resistance)
    assert depths[0] == pytest.approx(approach, rel=0.006)
    assert depths[1] == pytest.approx(locked, rel=0.006)
