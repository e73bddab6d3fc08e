"""A flat circular punch on a half-space gives Boussinesq's pressure and stiffness."""

import pytest
import torch

from tactile.contact import ContactState, solve_contact
from tests.physics import flat_punch
from tests.physics.half_space import HalfSpace

SIZE, RADIUS, NU, FORCE = 4.0, 1.5, 0.3, 0.2
MODULUS = 1.0 / (1.0 - NU**2)


def pressed_punch(samples: int) -> tuple[torch.Tensor, ContactState]:
    x = (torch.arange(samples, dtype=torch.float64) + 0.5) * SIZE / samples - SIZE / 2.0
    distance = torch.hypot(x[:, None], x[None, :])
    heights = torch.where(distance < RADIUS, 0.0, -10.0).double()
    return distance, solve_contact(HalfSpace(samples, SIZE, NU), heights, FORCE / SIZE**2)


def test_force_is_twice_modulus_times_radius_times_approach() -> None:
    _, state = pressed_punch(128)
    assert float(state.approach) == pytest.approx(flat_punch.approach(FORCE, RADIUS, MODULUS), rel=0.01)


def test_pressure_rises_to_the_rim_as_boussinesq_says() -> None:
    distance, state = pressed_punch(128)
    inner = distance < 0.8 * RADIUS
    expected = flat_punch.pressure(distance[inner], FORCE, RADIUS)
    assert float((state.pressure[inner] / expected - 1.0).abs().max()) < 0.02


def test_the_whole_punch_touches_and_nothing_else() -> None:
    distance, state = pressed_punch(64)
    assert torch.equal(state.pressure > 0.0, distance < RADIUS)
