"""A sphere on a half-space gives Hertz's contact."""

import math

import numpy as np
import pytest
import torch

from tactile.contact import ContactState, solve_contact
from tests.physics import hertz
from tests.physics.half_space import HalfSpace

SIZE = 4.0
RADIUS = 5.0
NU = 0.48
MODULUS = 1.0 / (1.0 - NU**2)
FORCE = 4.0 / 3.0 * MODULUS * 1.2**3 / RADIUS  # a contact radius of 1.2 mm


def pressed_sphere(samples: int) -> ContactState:
    x = (torch.arange(samples, dtype=torch.float64) + 0.5) * SIZE / samples - SIZE / 2.0
    heights = -(x[:, None] ** 2 + x[None, :] ** 2) / (2.0 * RADIUS)
    return solve_contact(HalfSpace(samples, SIZE, NU), heights, FORCE / SIZE**2)


def errors(samples: int) -> tuple[float, float, float]:
    """Relative errors of approach, peak pressure and contact radius."""
    state = pressed_sphere(samples)
    area = float((state.pressure > 0.0).sum()) * (SIZE / samples) ** 2
    return (
        float(state.approach) / hertz.approach(FORCE, RADIUS, MODULUS) - 1.0,
        float(state.pressure.max()) / hertz.peak_pressure(FORCE, RADIUS, MODULUS) - 1.0,
        math.sqrt(area / math.pi) / hertz.contact_radius(FORCE, RADIUS, MODULUS) - 1.0,
    )


@pytest.fixture(scope="module")
def errors_by_samples() -> dict[int, tuple[float, float, float]]:
    return {samples: errors(samples) for samples in (16, 32, 64, 128)}


def test_a_coarse_sphere_is_within_a_few_percent(errors_by_samples) -> None:
    approach, peak, radius = errors_by_samples[32]
    assert abs(approach) < 0.005
    assert abs(peak) < 0.02
    assert abs(radius) < 0.04


def test_approach_converges_at_least_linearly_with_the_pitch(errors_by_samples) -> None:
    sizes = np.array(sorted(errors_by_samples))
    wrong = [abs(errors_by_samples[s][0]) for s in sizes]
    rate = -np.polyfit(np.log(sizes), np.log(wrong), 1)[0]
    assert rate > 1.0


def test_every_quantity_is_within_one_percent_on_the_finest_grid(errors_by_samples) -> None:
    assert max(map(abs, errors_by_samples[128])) < 0.01


def test_approach_grows_as_the_two_thirds_power_of_force() -> None:
    x = (torch.arange(64, dtype=torch.float64) + 0.5) * SIZE / 64 - SIZE / 2.0
    heights = -(x[:, None] ** 2 + x[None, :] ** 2) / (2.0 * RADIUS)
    body = HalfSpace(64, SIZE, NU)
    light, heavy = (float(solve_contact(body, heights, f / SIZE**2).approach) for f in (FORCE / 2.0, FORCE))
    assert math.log2(heavy / light) == pytest.approx(2.0 / 3.0, rel=0.01)
