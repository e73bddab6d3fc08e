"""Ambient light stands for itself as a set of parallel lights."""

import numpy as np
import pytest

from visual.lights import LOWEST, ParallelLights, ambient_lights


def irradiance(lights: ParallelLights, normal: tuple[float, float, float]) -> float:
    return float(np.maximum(lights.toward @ np.array(normal), 0.0) @ lights.irradiance)


@pytest.mark.parametrize("count", [1, 16, 257])
def test_directions_are_unit_vectors_of_equal_strength(count: int) -> None:
    lights = ambient_lights(0.7, count)
    assert len(lights) == count
    np.testing.assert_allclose(np.linalg.norm(lights.toward, axis=1), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(lights.irradiance, lights.irradiance[0])


def test_light_comes_from_above_and_from_a_little_below_the_plane_of_the_plate() -> None:
    z = ambient_lights(1.0, 1000).toward[:, 2]
    assert z.min() == pytest.approx(LOWEST, abs=1e-3)
    assert z.max() == pytest.approx(1.0, abs=1e-3)
    assert np.mean(z > 0.5) == pytest.approx(0.5 / (1.0 - LOWEST), abs=2e-3)
    assert np.abs(z).min() >= 1e-4


@pytest.mark.parametrize(("count", "allowed"), [(16, 0.02), (256, 0.002)])
def test_a_horizontal_plane_receives_pi_times_the_radiance(count: int, allowed: float) -> None:
    assert irradiance(ambient_lights(0.4, count), (0, 0, 1)) == pytest.approx(0.4 * np.pi, rel=allowed)


@pytest.mark.parametrize("azimuth", [0.0, 1.0, 2.5])
def test_a_tilted_plane_receives_it_too_while_its_sky_is_not_cut_off(azimuth: float) -> None:
    tilt = np.arcsin(-LOWEST)
    normal = (np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt))
    assert irradiance(ambient_lights(0.4, 1024), normal) == pytest.approx(0.4 * np.pi, rel=5e-3)


def test_directions_drawn_anew_are_right_on_average() -> None:
    normal = (0.2, -0.1, np.sqrt(0.95))
    draws = [irradiance(ambient_lights(1.0, 3, np.random.default_rng(seed)), normal) for seed in range(4000)]
    standard_error = np.std(draws) / np.sqrt(len(draws))
    assert standard_error < 0.01 * np.pi
    assert abs(np.mean(draws) - np.pi) < 4.0 * standard_error


def test_the_same_generator_state_gives_the_same_directions() -> None:
    first, again, other = (ambient_lights(1.0, 8, np.random.default_rng(s)).toward for s in (5, 5, 6))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1
