"""Radiance of faces under parallel lights, and its derivatives by their slopes."""

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from tests.visual.scenes import ALBEDO, IRRADIANCE, Array, toward
from visual.exact.face_shading import shade
from visual.lights.parallel import ParallelLights

FACES = 200
UP = np.array([0.0, 0.0, 1.0])
GREY: dict[str, Any] = {"type": "spectrum", "value": ALBEDO}
MATERIALS: dict[str, dict[str, Any]] = {
    "diffuse": {"type": "diffuse", "reflectance": GREY},
    "roughplastic": {"type": "roughplastic", "diffuse_reflectance": GREY, "alpha": 0.3},
    "roughconductor": {"type": "roughconductor", "material": "none", "alpha": 0.4},
    "principled": {"type": "principled", "base_color": GREY, "roughness": 0.5, "specular": 0.5},
}


@pytest.fixture
def lights() -> ParallelLights:
    return ParallelLights(np.stack([toward(35, 10), toward(60, 200)]), np.array([IRRADIANCE, 0.5]))


@pytest.fixture
def slopes() -> tuple[Array, Array]:
    slope_x, slope_y = np.random.default_rng(0).normal(scale=0.6, size=(2, FACES))
    return slope_x, slope_y


def cosines(slopes: tuple[Array, Array], lights: ParallelLights) -> Array:
    """(lights, faces) between normals and lights."""
    normal = np.stack((-slopes[0], -slopes[1], np.ones(FACES)), axis=1)
    return lights.toward @ (normal / np.linalg.norm(normal, axis=1, keepdims=True)).T


def test_a_diffuse_face_follows_lamberts_law(
    mi: ModuleType, slopes: tuple[Array, Array], lights: ParallelLights
) -> None:
    shading = shade(mi.load_dict(MATERIALS["diffuse"]), *slopes, lights, UP)
    expected = ALBEDO / np.pi * lights.irradiance[:, None] * np.maximum(cosines(slopes, lights), 0.0)
    np.testing.assert_allclose(shading.radiance, expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("material", MATERIALS)
def test_derivatives_by_slope_are_those_of_finite_differences(
    mi: ModuleType, slopes: tuple[Array, Array], lights: ParallelLights, material: str
) -> None:
    bsdf = mi.load_dict(MATERIALS[material])
    step = 2e-3
    clear_of_terminator = np.abs(cosines(slopes, lights)) > 0.02
    shading = shade(bsdf, *slopes, lights, UP)
    for axis, derivative in enumerate((shading.by_slope_x, shading.by_slope_y)):
        there, back = (
            shade(bsdf, slopes[0] + move * (axis == 0), slopes[1] + move * (axis == 1), lights, UP).radiance
            for move in (step, -step)
        )
        expected = (there - back) / (2 * step)
        wrong = np.abs(derivative - expected)[clear_of_terminator]
        assert clear_of_terminator.mean() > 0.9
        assert np.abs(expected).max() > 0.1
        # Mitsuba reads the transmittance of rough plastic off a table, whose kinks a difference straddles.
        assert wrong.max() < 3e-3 * np.abs(expected).max()


@pytest.mark.parametrize("material", MATERIALS)
def test_faces_that_look_away_from_a_light_are_dark(
    mi: ModuleType, slopes: tuple[Array, Array], lights: ParallelLights, material: str
) -> None:
    shading = shade(mi.load_dict(MATERIALS[material]), *slopes, lights, UP)
    away = cosines(slopes, lights) < 0
    assert away.sum() > 10
    for values in (shading.radiance, shading.by_slope_x, shading.by_slope_y):
        np.testing.assert_array_equal(values[away], 0.0)
    assert (shading.radiance[cosines(slopes, lights) > 0.1] > 0).all()


def test_each_light_is_shaded_on_its_own(
    mi: ModuleType, slopes: tuple[Array, Array], lights: ParallelLights
) -> None:
    bsdf = mi.load_dict(MATERIALS["roughplastic"])
    together = shade(bsdf, *slopes, lights, UP)
    for number in range(len(lights)):
        alone = ParallelLights(lights.toward[[number]], lights.irradiance[[number]])
        np.testing.assert_allclose(
            together.radiance[number], shade(bsdf, *slopes, alone, UP).radiance[0], rtol=1e-5, atol=1e-7
        )
