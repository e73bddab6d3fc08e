"""Fields of many reliefs are those that each has alone."""

import numpy as np
import pytest

import tactile
from relief.relief import Relief
from retouch.laboratory.training.fields import BATCH, STUDIO, light_directions, picture_fields, touch_fields
from tests.tactile.reliefs import bumps, grating, waves
from visual.scene import Scene
from visual.scene_file.check import check_scene

SIDE, SIZE = 32, 10.0
SKIN = tactile.Skin()
AMBIENT = 0.22943058
"""Radiance of the studio's ambient light."""


@pytest.fixture(scope="module")
def reliefs() -> np.ndarray:
    many = [waves(SIDE, height, seed) for seed, height in enumerate(np.linspace(0.3, 2.5, BATCH))]
    return np.stack([relief.numpy() for relief in (*many, grating(SIDE), bumps(SIDE))])


def test_a_flat_plate_is_felt_as_nothing() -> None:
    touched = touch_fields(np.zeros((1, SIDE, SIDE)), SIZE, SKIN, "layer")
    np.testing.assert_allclose(touched["strain"], 0.0, atol=1e-6)
    np.testing.assert_allclose(touched["gap"], 0.0, atol=1e-6)
    assert touched["roughness"] == pytest.approx(0.0, abs=1e-7)
    assert touched["contact_area_mm2"] == pytest.approx(SIZE**2, rel=1e-5)
    assert touched["contact_fraction"] == pytest.approx(1.0)


@pytest.mark.parametrize("model", ["layer", pytest.param("fem", marks=pytest.mark.slow)])
def test_reliefs_in_batches_are_felt_as_each_alone(reliefs: np.ndarray, model: str) -> None:
    touched = touch_fields(reliefs, SIZE, SKIN, model)  # type: ignore[arg-type]
    for number in (0, BATCH - 1, BATCH, len(reliefs) - 1):
        alone = tactile.press(reliefs[number], SIZE, SKIN, model)  # type: ignore[arg-type]
        np.testing.assert_allclose(touched["strain"][number], alone.strain, atol=1e-5)
        np.testing.assert_allclose(touched["gap"][number], alone.gap, atol=1e-5)
        roughness = tactile.roughness(alone.strain, SIZE).item()
        assert touched["roughness"][number] == pytest.approx(roughness, rel=1e-4)
        area = tactile.contact_area(alone.gap, SIZE).item()
        assert touched["contact_area_mm2"][number] == pytest.approx(area, rel=1e-4)
        assert touched["contact_fraction"][number] == pytest.approx(alone.contact_fraction.item(), abs=2e-3)


def test_single_precision_is_for_the_fields_only(reliefs: np.ndarray) -> None:
    touched = touch_fields(reliefs.astype(np.float32), SIZE, SKIN, "layer")
    assert {name: values.dtype for name, values in touched.items()} == {
        **dict.fromkeys(("strain", "gap", "pressure"), np.float32),
        **dict.fromkeys(("roughness", "contact_area_mm2", "contact_fraction"), np.float64),
    }


def test_a_relief_that_is_no_number_is_refused(reliefs: np.ndarray) -> None:
    spoilt = reliefs.copy()
    spoilt[3, 4, 5] = np.nan
    with pytest.raises(tactile.InputError, match="finite"):
        touch_fields(spoilt, SIZE, SKIN, "layer")


@pytest.mark.slow
def test_sums_of_pictures_are_the_studios(reliefs: np.ndarray) -> None:
    checked = check_scene(STUDIO, {"resolution": str(SIDE)})
    scene = Scene(checked, Relief(reliefs[5]), "llvm_ad_mono")
    renders = np.stack([scene.render(samples=256, seed=seed).numpy() for seed in range(3)])
    fields = picture_fields(reliefs[5], light_directions("studio", 3, 0), 12, 0)
    sums = fields["pictures"] + AMBIENT * fields["ambient"]
    mean = renders.mean(0)
    noise = renders.std(0, ddof=1).mean()
    assert np.abs(sums - mean).mean() < noise + 0.01 * mean.mean()
    np.testing.assert_allclose(sums.mean((1, 2)), mean.mean((1, 2)), rtol=5e-3)


def test_random_lights_are_of_their_range_and_of_their_seed() -> None:
    toward = light_directions("random", 2000, 3)
    np.testing.assert_allclose(np.linalg.norm(toward, axis=1), 1.0, rtol=1e-12)
    elevation = np.degrees(np.arcsin(toward[:, 2]))
    azimuth = np.degrees(np.arctan2(toward[:, 1], toward[:, 0]))
    assert 10.0 <= elevation.min() < 11.0 and 79.0 < elevation.max() <= 80.0
    np.testing.assert_allclose(np.histogram(elevation, 7, (10, 80))[0], 2000 / 7, rtol=0.2)
    np.testing.assert_allclose(np.histogram(azimuth, 8, (-180, 180))[0], 250, rtol=0.25)
    np.testing.assert_array_equal(toward, light_directions("random", 2000, 3))
    assert (toward != light_directions("random", 2000, 4)).any()


def test_the_studio_has_its_own_lights() -> None:
    toward = light_directions("studio", 3, 9)
    np.testing.assert_allclose(toward[:, 2], np.sin(np.radians(35.0)))
    with pytest.raises(ValueError, match="3 lights"):
        light_directions("studio", 4, 9)
