"""Bonded layers obey elasticity: equal layers are one, limits of stiff films and thick layers, continuity."""

import numpy as np
import pytest

from relief.ground.arrays import Array
from tactile.layer.layer_response import LayerResponse, layer_response
from tactile.layer.skin_layers import Stack
from tactile.skin import lame
from tests.tactile.by_exponentials import by_exponentials
from tests.tactile.test_layer_response import DEPTH, RATIOS, THICKNESS, WAVENUMBERS

STIFF_OVER_SOFT: Stack = ((0.7, 5.0),)
THREE: Stack = ((0.02, 300.0), (0.4, 0.2), (0.5, 8.0))
EVERY_STACK = pytest.mark.parametrize("stack", [STIFF_OVER_SOFT, THREE], ids=["two layers", "four layers"])


def amplitudes(response: LayerResponse) -> dict[str, Array]:
    return vars(response)


@RATIOS
@pytest.mark.parametrize(
    "stack", [(), ((0.5, 1.0),), ((0.3, 1.0), (0.45, 1.0), (0.2, 1.0)), ((0.02, 1.0),), ((2.4, 1.0),)]
)
def test_equal_layers_are_one_layer(nu: float, stack: Stack) -> None:
    """By another method: the one layer is solved for the constants of exponentials."""
    one = by_exponentials(WAVENUMBERS, nu, THICKNESS, DEPTH)
    several = layer_response(WAVENUMBERS, nu, THICKNESS, DEPTH, stack)
    for name, expected in amplitudes(one).items():
        size = np.abs(expected).max()
        np.testing.assert_allclose(amplitudes(several)[name], expected, rtol=0.0, atol=1e-10 * size)
    np.testing.assert_allclose(several.surface, one.surface, rtol=1e-10)


@pytest.mark.parametrize("nu", [0.3, 0.48])
def test_a_stiff_thin_film_is_a_plate(nu: float) -> None:
    """Plate theory: a bonded film keeps the base from sliding, and adds its bending stiffness times k^4."""
    film, ratio, k = 3e-4, 3.7e7, np.geomspace(2.0, 40.0, 50)
    _, mu = lame(1.0, nu)
    base = 4.0 * (1.0 - nu) / (3.0 - 4.0 * nu) * mu * k  # a half-space whose surface does not slide
    plate = ratio * film**3 / (12.0 * (1.0 - nu**2)) * k**4
    assert plate[0] < 1e-2 * base[0] and plate[-1] > 2.0 * base[-1]
    surface = layer_response(k, nu, 20.0, DEPTH, ((film, ratio),)).surface
    np.testing.assert_allclose(surface, 1.0 / (base + plate), rtol=1.5e-3)


@RATIOS
def test_short_waves_feel_the_top_layer_only(nu: float) -> None:
    k = np.array([8.0, 30.0, 200.0])
    surface = layer_response(k, nu, 12.5, DEPTH, ((6.0, 3.0),)).surface
    np.testing.assert_allclose(surface, 2.0 * (1.0 - nu**2) / (3.0 * k), rtol=1e-12)


@RATIOS
def test_a_base_far_stiffer_than_the_top_layer_is_bone(nu: float) -> None:
    k, top = np.geomspace(0.05, 20.0, 50), 1.5
    alone = amplitudes(by_exponentials(k, nu, top, DEPTH))
    above = amplitudes(layer_response(k, nu, THICKNESS, DEPTH, ((top, 1e-8),)))
    for name, expected in alone.items():
        size = np.abs(expected).max()
        np.testing.assert_allclose(1e-8 * above[name], expected, rtol=0.0, atol=1e-5 * size)


@RATIOS
@EVERY_STACK
def test_displacements_and_stresses_pass_through_a_boundary(nu: float, stack: Stack) -> None:
    lam, mu = lame(1.0, nu)
    k, boundary = np.geomspace(0.05, 20.0, 50), sum(thickness for thickness, _ in stack)
    sides = [
        (layer_response(k, nu, THICKNESS, boundary + step, stack), modulus)
        for step, modulus in ((-1e-6, stack[-1][1]), (0.0, 1.0))
    ]
    above, below = (
        (
            response.normal,
            response.lateral,
            modulus * mu * (response.lateral_slope - k * response.normal),
            modulus * ((lam + 2.0 * mu) * response.normal_slope + lam * k * response.lateral),
        )
        for response, modulus in sides
    )
    for one, other in zip(above, below, strict=True):
        np.testing.assert_allclose(one, other, rtol=0.0, atol=2e-4 * np.abs(other).max())
    slopes = [response.lateral_slope for response, _ in sides]
    assert np.abs(slopes[0] - slopes[1]).max() > 0.1 * np.abs(slopes[1]).max()


@RATIOS
@EVERY_STACK
def test_slopes_are_the_derivatives_of_displacements_by_depth(nu: float, stack: Stack) -> None:
    k, step = np.geomspace(0.05, 20.0, 50), 1e-4
    for depth in (0.3, 1.2):
        here, below, above = (layer_response(k, nu, THICKNESS, depth + d, stack) for d in (0.0, step, -step))
        for value, slope in (("normal", "normal_slope"), ("lateral", "lateral_slope")):
            measured = (getattr(below, value) - getattr(above, value)) / (2.0 * step)
            expected = getattr(here, slope)
            np.testing.assert_allclose(measured, expected, rtol=1e-5, atol=2e-6 * np.abs(expected).max())


@RATIOS
@EVERY_STACK
def test_uniform_pressure_squeezes_a_row_of_springs(nu: float, stack: Stack) -> None:
    lam, mu = lame(1.0, nu)
    springs = [thickness / modulus for thickness, modulus in stack]
    springs.append(THICKNESS - sum(thickness for thickness, _ in stack))
    uniform = layer_response(np.zeros(1), nu, THICKNESS, 2.0, stack)
    assert uniform.surface == pytest.approx(sum(springs) / (lam + 2.0 * mu), rel=1e-12)
    assert uniform.normal == pytest.approx(0.5 / (lam + 2.0 * mu), rel=1e-12)
    assert uniform.normal_slope == pytest.approx(-1.0 / (lam + 2.0 * mu), rel=1e-12)
    nearly = layer_response(np.full(1, 1e-4), nu, THICKNESS, 2.0, stack)
    assert nearly.surface == pytest.approx(uniform.surface, rel=2e-3)
