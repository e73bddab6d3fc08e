"""Quadratic tetrahedra agree with the structured block, with Hertz, and with themselves."""

from collections.abc import Callable

import numpy as np
import pytest
import skfem
import torch
from torch import Tensor

from relief.ground.errors import InputError
from tactile import Skin, contact_area, roughness
from tactile.contact import solve_contact
from tactile.elements.finite_elements import FiniteElementOperator, finite_element_operator
from tactile.skin import lame
from tactile.strain import smallest_eigenvalue
from tactile.touch import Touch
from tactile.unstructured.meshing import Sizing, Tetrahedra, signed_volumes, tetrahedralise
from tactile.unstructured.quadratic import gradients_at, stiffness
from tactile.unstructured.surface import ClosedSurface
from tactile.unstructured.tetrahedra import (
    TetrahedralOperator,
    press_tetrahedra,
    tetrahedral_operator,
)
from tests.recorded import Truth, Truths, solved
from tests.tactile.reliefs import SIZE, bumps, grating, waves
from tests.tactile.unstructured.skin_surfaces import block_surface, fingertip_surface
from tests.taylor import dot_test

pytestmark = pytest.mark.slow

Body = TetrahedralOperator | FiniteElementOperator

SAMPLES = 32
SOFT = Skin(young_modulus_mpa=0.25)
MEAN_PRESSURE = SOFT.mean_pressure_mpa(SIZE) / SOFT.young_modulus_mpa
FINGER = Skin(thickness_mm=2.8)
SHEARED = np.array([[0.03, 0.02, -0.01], [0.01, -0.04, 0.02], [0.05, -0.02, 0.01]])
"""A uniform displacement gradient."""


def box(x: np.ndarray, z: np.ndarray, radius: float | None = None) -> Tetrahedra:
    """A structured mesh of a block, whose lower face is flat or a spherical cap of some radius."""
    mesh = skfem.MeshTet.init_tensor(x, x, z)
    vertices = mesh.p.T.copy()
    if radius is not None:
        sag = radius - np.sqrt(radius**2 - vertices[:, 0] ** 2 - vertices[:, 1] ** 2)
        vertices[:, 2] = sag + (1.0 - sag / z[-1]) * vertices[:, 2]
    cells = mesh.t.T.astype(np.int64)
    turned = signed_volumes(vertices, cells) < 0.0
    cells[turned] = cells[turned][:, [0, 1, 3, 2]]
    return Tetrahedra(vertices, cells)


def centred(half: float, finest: float, elements: int) -> np.ndarray:
    """Nodes from -half to half, spaced by about `finest` in the middle and wider outward."""
    ratio = half / (finest * elements)
    step = np.linspace(0.0, 1.0, elements + 1)
    quarter = half * (step / ratio + (1.0 - 1.0 / ratio) * step**3)
    return np.concatenate((-quarter[:0:-1], quarter))


@pytest.fixture(scope="module")
def small() -> TetrahedralOperator:
    mesh = box(np.linspace(-5.0, 5.0, 9), np.linspace(0.0, 2.5, 4))
    return tetrahedral_operator(SOFT, mesh, 16, SIZE)


@pytest.fixture(scope="module")
def block() -> TetrahedralOperator:
    mesh = tetrahedralise(block_surface(SIZE, SOFT.thickness_mm), Sizing(0.4, 0.9))
    return tetrahedral_operator(SOFT, mesh, SAMPLES, SIZE)


@pytest.fixture(scope="module")
def rounded() -> TetrahedralOperator:
    """A fingertip of radius 12 mm."""
    mesh = box(np.linspace(-5.0, 5.0, 15), np.array([0.0, 0.5, 1.2, FINGER.thickness_mm]), radius=12.0)
    return tetrahedral_operator(FINGER, mesh, 20, SIZE)


def strain_of(body: Body, heights: Tensor) -> tuple[Tensor, Tensor]:
    """Strain map less the flat plate's, and the approach to the flat plate."""
    pressed, flat = (solve_contact(body, h, MEAN_PRESSURE) for h in (heights, torch.zeros_like(heights)))
    pressed_strain, flat_strain = (smallest_eigenvalue(body.strain(c.pressure)) for c in (pressed, flat))
    return pressed_strain - flat_strain, flat.approach


def test_uniform_strain_is_reproduced() -> None:
    mesh = skfem.MeshTet().refined(2)
    basis = skfem.Basis(mesh, skfem.ElementTetP2(), intorder=2)
    field = SHEARED @ basis.doflocs
    strain = 0.5 * (SHEARED + SHEARED.T)
    lam, mu = lame(1.0, 0.48)
    stress = lam * np.trace(strain) * np.eye(3) + 2.0 * mu * strain

    force = (stiffness(basis, 0.48) @ field.ravel()).reshape(3, -1)
    inside = ((basis.doflocs > 1e-9) & (basis.doflocs < 1.0 - 1e-9)).all(axis=0)
    assert np.abs(force[:, inside]).max() < 1e-14
    assert field.ravel() @ force.ravel() == pytest.approx(np.sum(stress * strain))

    points = np.random.default_rng(0).uniform(0.05, 0.95, (20, 3))
    slopes = np.stack([operator @ field.T for operator in gradients_at(basis, points)])
    np.testing.assert_allclose(slopes, np.broadcast_to(SHEARED.T[:, None], slopes.shape), atol=1e-12)


def test_compliance_and_its_preconditioner_are_their_own_adjoints(small: TetrahedralOperator) -> None:
    for symmetric in (small.displacement, small.precondition):
        one, other = torch.randn(2, 16, 16, dtype=torch.float64)
        assert dot_test(symmetric, symmetric, one, other) < 1e-12


def test_pressures_add_up_to_their_force(small: TetrahedralOperator) -> None:
    np.testing.assert_allclose(np.asarray(small.forces.sum(axis=0)), (SIZE / 16) ** 2, rtol=1e-12)


def test_a_flat_plate_sinks_in_as_far_as_into_the_structured_block(block: TetrahedralOperator) -> None:
    reference = finite_element_operator(SOFT, SAMPLES, SIZE)
    flat = torch.zeros(SAMPLES, SAMPLES, dtype=torch.float64)
    states = [solve_contact(body, flat, MEAN_PRESSURE) for body in (block, reference)]
    assert float(states[0].approach) == pytest.approx(float(states[1].approach), rel=0.02)
    strains = [
        smallest_eigenvalue(body.strain(state.pressure))
        for body, state in ((block, states[0]), (reference, states[1]))
    ]
    assert float(strains[0].mean()) == pytest.approx(float(strains[1].mean()), rel=0.02)


@pytest.mark.parametrize("relief", [grating, bumps])
def test_roughness_is_that_of_the_structured_block(
    block: TetrahedralOperator, relief: Callable[[int], Tensor]
) -> None:
    """Within 10 %: at this pitch the two spread a pixel's pressure differently (2 % at half the pitch)."""
    heights = relief(SAMPLES)
    ours, theirs = (
        strain_of(block, heights)[0],
        strain_of(finite_element_operator(SOFT, SAMPLES, SIZE), heights)[0],
    )
    assert float(roughness(ours, SIZE)) == pytest.approx(float(roughness(theirs, SIZE)), rel=0.1)
    assert np.corrcoef(ours.ravel(), theirs.ravel())[0, 1] > 0.985


def test_every_strain_has_the_axes_of_the_structured_block(block: TetrahedralOperator) -> None:
    pressure = waves(SAMPLES, 1.0, seed=2)
    ours, theirs = block.strain(pressure), finite_element_operator(SOFT, SAMPLES, SIZE).strain(pressure)
    for one, other in zip(ours, theirs, strict=True):
        assert np.corrcoef(one.ravel(), other.ravel())[0, 1] > 0.97


def test_a_mirrored_relief_gives_a_mirrored_field(block: TetrahedralOperator) -> None:
    """As well as a mesh does that is not its own mirror image, and another one each time it is made."""
    heights = waves(SAMPLES, 0.8, seed=5)
    strain, mirrored = strain_of(block, torch.stack((heights, heights.flip(-1))))[0]
    assert np.corrcoef(strain.ravel(), mirrored.flip(-1).ravel())[0, 1] > 0.98
    assert float(roughness(mirrored, SIZE)) == pytest.approx(float(roughness(strain, SIZE)), rel=0.03)


def test_a_fingertip_touches_a_plate_as_hertz_says() -> None:
    """Contact radius a = (3 F R / 4 E*)^(1/3) (Johnson, Contact Mechanics, 1985, section 4.2).

    The radius is taken from the mean of r² under the pressure, 2/5 a²; the body is 12 times as thick as
    the contact is wide.
    """
    radius, touched, samples, contact_radius, nu = 20.0, 4.0, 16, 1.2, 0.3
    mesh = box(centred(10.0, 0.5, 7), np.array([0.0, 0.35, 0.8, 1.6, 3.0, 5.5, 9.0, 14.0]), radius)
    skin = Skin(poisson_ratio=nu, thickness_mm=14.0)
    body = tetrahedral_operator(skin, mesh, samples, touched)
    force = 4.0 * contact_radius**3 / (3.0 * radius * (1.0 - nu**2))
    state = solve_contact(body, -body.rise_mm, force / touched**2)
    line = (np.arange(samples) + 0.5) * touched / samples - 0.5 * touched
    square = torch.as_tensor(line[:, None] ** 2 + line**2)
    measured = float((2.5 * (state.pressure * square).sum() / state.pressure.sum()).sqrt())
    assert measured == pytest.approx(contact_radius, rel=0.03)
    assert float(state.approach) == pytest.approx(contact_radius**2 / radius, rel=0.05)


def test_a_rounded_skin_touches_more_under_more_force(rounded: TetrahedralOperator) -> None:
    plate = -rounded.rise_mm
    shares = [
        float((solve_contact(rounded, plate, m).pressure > 0.0).double().mean()) for m in (0.01, 0.05, 0.2)
    ]
    assert 0.0 < shares[0] < shares[1] < shares[2] <= 1.0


def test_a_rounded_skin_feels_nothing_of_a_flat_plate(rounded: TetrahedralOperator) -> None:
    plate = torch.zeros(20, 20, dtype=torch.float64)
    touch = press_tetrahedra(plate, FINGER, rounded)
    assert isinstance(touch, Touch)
    assert float(touch.strain.abs().max()) == 0.0
    assert float(touch.pressure.mean()) == pytest.approx(0.1)
    assert 0.0 < float(touch.contact_fraction) < 1.0
    assert float(touch.gap.min()) > -1e-8


def test_a_fingertip_given_as_a_surface_feels_what_its_structured_mesh_feels(truths: Truths) -> None:
    """Meshed by pytetwild and pressed, end to end; 2 % in V and 3 % in A when this was written."""
    surface = fingertip_surface(SIZE, FINGER.thickness_mm, 12.0)
    mesh = box(np.linspace(-5.0, 5.0, 25), np.array([0.0, 0.3, 0.65, 1.1, 1.6, 2.2, 2.8]), radius=12.0)

    def numbers(touch: Touch) -> list[float]:
        felt = roughness(touch.strain, SIZE), contact_area(touch.gap, SIZE), touch.approach
        return [float(number) for number in felt]

    def structured() -> Truth:
        operator = tetrahedral_operator(FINGER, mesh, 20, SIZE)
        touch = press_tetrahedra(bumps(20), FINGER, operator)
        return solved([*numbers(touch), *touch.strain.ravel()])

    inputs = [repr(FINGER), bumps(20), mesh.vertices, mesh.cells]
    expected, strain = np.split(truths(inputs, structured).mean, [3])
    meshed = tetrahedral_operator(FINGER, tetrahedralise(surface, Sizing(0.5, 0.9)), 20, SIZE)
    touch = press_tetrahedra(bumps(20), FINGER, meshed)
    for ours, theirs, allowed in zip(numbers(touch), expected, (0.06, 0.1, 0.03), strict=True):
        assert ours == pytest.approx(theirs, rel=allowed)
    assert np.corrcoef(touch.strain.ravel(), strain)[0, 1] > 0.98


def test_strain_is_zero_where_the_receptors_would_lie_in_the_bone(rounded: TetrahedralOperator) -> None:
    in_bone = rounded.rise_mm + 0.75 > FINGER.thickness_mm
    strain = rounded.strain(torch.ones(20, 20, dtype=torch.float64))
    assert bool(in_bone.any())
    assert float(strain[:, in_bone].abs().max()) == 0.0
    assert float(strain[2][~in_bone].abs().min()) > 0.0


def test_a_square_wider_than_the_skin_is_refused() -> None:
    mesh = box(np.linspace(-2.0, 2.0, 4), np.linspace(0.0, 2.5, 3))
    with pytest.raises(InputError, match="size_mm"):
        tetrahedral_operator(SOFT, mesh, 16, SIZE)


def test_the_surface_of_a_mesh_is_a_surface() -> None:
    mesh = box(np.linspace(-2.0, 2.0, 4), np.linspace(0.0, 2.5, 3))
    assert ClosedSurface(mesh.vertices, mesh.boundary()).volume_mm3 == pytest.approx(40.0)
