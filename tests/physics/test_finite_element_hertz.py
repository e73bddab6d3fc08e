"""A small sphere on the block of finite elements gives Hertz's contact, but for what the bone adds."""

import math

import numpy as np
import pytest

from tactile.contact import solve_contact
from tactile.elements.finite_elements import finite_element_operator
from tactile.layer.layer_response import layer_response
from tactile.skin import Skin
from tests.physics import hertz
from tests.tactile.reliefs import SIZE, centres

SKIN = Skin()
RADIUS, CONTACT = 2.0, 0.6
MODULUS = 1.0 / (1.0 - SKIN.poisson_ratio**2)
FORCE = 4.0 / 3.0 * MODULUS * CONTACT**3 / RADIUS


def layer_shift() -> float:
    """Displacement (mm/N) under a point force on a bonded layer less that on a half-space, at E = 1 MPa.

    The inverse Hankel transform of the difference of their compliances, at the origin: the first term of an
    expansion in contact radius over thickness (Johnson, Contact Mechanics, section 5.8).
    """
    k = np.linspace(1e-6, 40.0, 40001)
    layer = layer_response(k, SKIN.poisson_ratio, SKIN.thickness_mm, SKIN.depth_mm).surface
    half_space = 2.0 / (MODULUS * k)
    return float(np.trapezoid((layer - half_space) * k, k) / (2.0 * math.pi))


def errors(samples: int) -> dict[str, float]:
    """Relative; the radius is that of Hertz's pressure with the same second moment (2/5 of its square)."""
    square = (centres(samples) - 0.5 * SIZE) ** 2
    distance2 = square[:, None] + square[None, :]
    state = solve_contact(
        finite_element_operator(SKIN, samples, SIZE), -distance2 / (2.0 * RADIUS), FORCE / SIZE**2
    )
    moment = float((state.pressure * distance2).sum() / state.pressure.sum())
    approach = hertz.approach(FORCE, RADIUS, MODULUS) + FORCE * layer_shift()
    return {
        "radius": math.sqrt(2.5 * moment) / hertz.contact_radius(FORCE, RADIUS, MODULUS) - 1.0,
        "peak pressure": float(state.pressure.max()) / hertz.peak_pressure(FORCE, RADIUS, MODULUS) - 1.0,
        "approach": float(state.approach) / approach - 1.0,
    }


@pytest.fixture(scope="module")
def by_samples() -> dict[int, dict[str, float]]:
    return {samples: errors(samples) for samples in (32, 48)}


@pytest.mark.parametrize(
    ("quantity", "coarse", "fine"), [("radius", 0.03, 0.01), ("peak pressure", 0.08, 0.04)]
)
def test_hertz_is_approached_with_the_pitch(
    by_samples: dict[int, dict[str, float]], quantity: str, coarse: float, fine: float
) -> None:
    """The contact is 4 pixels wide on the coarse grid and 6 on the fine one."""
    assert abs(by_samples[32][quantity]) < coarse
    assert abs(by_samples[48][quantity]) < fine
    assert abs(by_samples[48][quantity]) < 0.6 * abs(by_samples[32][quantity])


@pytest.mark.parametrize("samples", [32, 48])
def test_the_sphere_goes_as_deep_as_hertz_says(by_samples: dict[int, dict[str, float]], samples: int) -> None:
    """Within what the first term of the layer's expansion leaves out."""
    assert abs(by_samples[samples]["approach"]) < 0.012


def test_the_bone_makes_the_sphere_go_less_deep() -> None:
    assert -0.2 < FORCE * layer_shift() / hertz.approach(FORCE, RADIUS, MODULUS) < -0.1
