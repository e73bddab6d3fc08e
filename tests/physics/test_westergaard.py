"""A sinusoid on a half-space gives Westergaard's contact."""

import pytest
import torch

from tactile.contact import ContactState, solve_contact
from tests.physics import westergaard
from tests.physics.half_space import PeriodicHalfSpace

WAVELENGTH, AMPLITUDE, NU, SAMPLES = 4.0, 0.1, 0.3, 256
MODULUS = 1.0 / (1.0 - NU**2)
CLOSING = westergaard.full_contact_pressure(AMPLITUDE, WAVELENGTH, MODULUS)
X = (torch.arange(SAMPLES, dtype=torch.float64) + 0.5) * WAVELENGTH / SAMPLES - WAVELENGTH / 2.0


def pressed_sinusoid(mean_pressure: float) -> ContactState:
    heights = AMPLITUDE * torch.cos(2.0 * torch.pi * X / WAVELENGTH).expand(SAMPLES, SAMPLES)
    return solve_contact(PeriodicHalfSpace(SAMPLES, WAVELENGTH, NU), heights, mean_pressure)


@pytest.mark.parametrize("load", [0.05, 0.2, 0.5, 0.8])
def test_contact_follows_the_sine_squared_law(load: float) -> None:
    state = pressed_sinusoid(load * CLOSING)
    fraction = float((state.pressure > 0.0).double().mean())
    expected = westergaard.contact_fraction(load * CLOSING, CLOSING)
    assert fraction == pytest.approx(expected, abs=2.0 / SAMPLES)


@pytest.mark.parametrize("load", [0.2, 0.5])
def test_pressure_is_westergaards(load: float) -> None:
    state = pressed_sinusoid(load * CLOSING)
    expected = westergaard.pressure(X, load * CLOSING, CLOSING, WAVELENGTH)
    error = (state.pressure - expected).norm(dim=-1).max() / expected.norm()
    assert float(error) < 0.02


def test_contact_closes_at_the_full_contact_pressure() -> None:
    assert float((pressed_sinusoid(0.99 * CLOSING).pressure > 0.0).double().mean()) < 1.0
    assert float((pressed_sinusoid(1.01 * CLOSING).pressure > 0.0).double().mean()) == 1.0
