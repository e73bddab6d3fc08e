"""The bonded layer obeys elasticity: closed form, limits, boundary conditions, equilibrium."""

import numpy as np
import pytest

from relief.ground.arrays import Array
from tactile.layer.layer_response import layer_response
from tactile.skin import lame

THICKNESS, DEPTH = 2.5, 0.75
WAVENUMBERS = np.geomspace(0.01, 200.0, 400)
RATIOS = pytest.mark.parametrize("nu", [0.0, 0.3, 0.48, 0.499])


def carbone_mangialardi(wavenumbers: Array, poisson_ratio: float, thickness_mm: float) -> Array:
    """Closed form of `LayerResponse.surface`.

    Carbone and Mangialardi, J. Mech. Phys. Solids 56 (2008).

    Args:
        wavenumbers: k > 0 in 1/mm.
        poisson_ratio: nu.
        thickness_mm: t.
    """
    nu, kt = poisson_ratio, wavenumbers * thickness_mm
    e2, e4 = np.exp(-2.0 * kt), np.exp(-4.0 * kt)  # hyperbolic functions divided by e^{2kt}/2
    top = (3.0 - 4.0 * nu) * (1.0 - e4) - 4.0 * kt * e2
    bottom = 2.0 * (5.0 + 2.0 * kt**2 - 4.0 * nu * (3.0 - 2.0 * nu)) * e2 + (3.0 - 4.0 * nu) * (1.0 + e4)
    return 2.0 * (1.0 - nu**2) / wavenumbers * top / bottom


# Long waves on a nearly incompressible layer cancel digits, in the closed form as in the system of four.
@pytest.mark.parametrize(("nu", "tolerance"), [(0.0, 1e-12), (0.3, 1e-12), (0.48, 1e-12), (0.499, 1e-11)])
def test_surface_compliance_is_carbone_and_mangialardis(nu: float, tolerance: float) -> None:
    surface = layer_response(WAVENUMBERS, nu, THICKNESS, DEPTH).surface
    np.testing.assert_allclose(surface, carbone_mangialardi(WAVENUMBERS, nu, THICKNESS), rtol=tolerance)


@RATIOS
def test_uniform_pressure_squeezes_uniaxially(nu: float) -> None:
    lam, mu = lame(1.0, nu)
    uniform = layer_response(np.zeros(1), nu, THICKNESS, DEPTH)
    assert uniform.surface == pytest.approx(THICKNESS / (lam + 2.0 * mu), rel=1e-14)
    assert uniform.normal_slope == pytest.approx(-1.0 / (lam + 2.0 * mu), rel=1e-14)
    assert uniform.lateral == 0.0
    nearly = layer_response(np.full(1, 1e-3), nu, THICKNESS, DEPTH)
    assert nearly.surface == pytest.approx(uniform.surface, rel=2e-3)


@RATIOS
def test_short_waves_see_a_half_space(nu: float) -> None:
    k = np.array([10.0, 50.0, 200.0])
    surface = layer_response(k, nu, THICKNESS, DEPTH).surface
    np.testing.assert_allclose(surface, 2.0 * (1.0 - nu**2) / k, rtol=1e-12)


@RATIOS
def test_the_surface_bears_the_pressure_and_no_shear(nu: float) -> None:
    lam, mu = lame(1.0, nu)
    top = layer_response(WAVENUMBERS, nu, THICKNESS, 0.0)
    np.testing.assert_allclose(top.normal, top.surface, rtol=1e-14)
    shear_strain = top.lateral_slope - WAVENUMBERS * top.normal
    np.testing.assert_allclose(mu * shear_strain, 0.0, atol=1e-10)
    normal_stress = (lam + 2.0 * mu) * top.normal_slope + lam * WAVENUMBERS * top.lateral
    np.testing.assert_allclose(normal_stress, -1.0, rtol=1e-9)


@RATIOS
def test_the_bonded_face_does_not_move(nu: float) -> None:
    bottom = layer_response(WAVENUMBERS, nu, THICKNESS, THICKNESS - 1e-8)
    np.testing.assert_allclose(bottom.normal, 0.0, atol=2e-8)
    np.testing.assert_allclose(bottom.lateral, 0.0, atol=2e-8)


@RATIOS
def test_slopes_are_the_derivatives_of_displacements_by_depth(nu: float) -> None:
    k, step = np.geomspace(0.05, 20.0, 50), 1e-4
    here, below, above = (layer_response(k, nu, THICKNESS, DEPTH + d) for d in (0.0, step, -step))
    for value, slope in (("normal", "normal_slope"), ("lateral", "lateral_slope")):
        measured = (getattr(below, value) - getattr(above, value)) / (2.0 * step)
        expected = getattr(here, slope)
        np.testing.assert_allclose(measured, expected, rtol=1e-5, atol=1e-6 * np.abs(expected).max())


@RATIOS
def test_stresses_inside_are_in_equilibrium(nu: float) -> None:
    lam, mu = lame(1.0, nu)
    k, step = np.geomspace(0.05, 20.0, 50), 1e-4
    here, below, above = (layer_response(k, nu, THICKNESS, DEPTH + d) for d in (0.0, step, -step))
    normal_bend = (below.normal_slope - above.normal_slope) / (2.0 * step)
    lateral_bend = (below.lateral_slope - above.lateral_slope) / (2.0 * step)
    lateral_stress = (lam + 2.0 * mu) * k * here.lateral + lam * here.normal_slope
    along = -k * lateral_stress + mu * (lateral_bend - k * here.normal_slope)
    shear = mu * (here.lateral_slope - k * here.normal)
    across = k * shear + (lam + 2.0 * mu) * normal_bend + lam * k * here.lateral_slope
    size = np.abs(np.stack((k * lateral_stress, k * shear, lam * normal_bend))).max()
    np.testing.assert_allclose(along, 0.0, atol=1e-6 * size)
    np.testing.assert_allclose(across, 0.0, atol=1e-6 * size)
