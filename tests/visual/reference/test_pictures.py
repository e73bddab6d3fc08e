"""Pictures in closed form are those that Mitsuba's samples converge to."""

from pathlib import Path

import numpy as np
import pytest

from tests.tactile.reliefs import waves
from visual.reference.pictures import Relit
from visual.scene import Scene
from visual.scene_file.check import check_scene

STUDIO = Path(__file__).resolve().parents[3] / "mitsuba_scenes" / "studio.xml"
SIDE = 32
ELEVATION = np.radians(35.0)
TOWARD = np.array(
    [
        [np.cos(ELEVATION) * np.cos(a), np.cos(ELEVATION) * np.sin(a), np.sin(ELEVATION)]
        for a in np.radians([10.0, 130.0, 250.0])
    ]
)
AMBIENT = 0.22943058


@pytest.fixture(scope="module")
def scene() -> Scene:
    checked = check_scene(STUDIO, {"resolution": str(SIDE)})
    return Scene(checked, np.zeros((SIDE, SIDE)), "llvm_ad_mono")


@pytest.fixture(scope="module")
def relit(scene: Scene) -> Relit:
    return Relit(scene)


def test_a_flat_plate_is_as_bright_everywhere(relit: Relit) -> None:
    flat = np.zeros((SIDE, SIDE))
    sunlit, skylit = relit.sunlit(flat, TOWARD), relit.skylit(flat, 0)
    np.testing.assert_allclose(sunlit, sunlit[0, 0, 0], rtol=1e-5)
    np.testing.assert_allclose(skylit, skylit.mean(), rtol=2e-3)
    assert 0.2 < sunlit.mean() < 0.5


def test_the_studio_is_rendered_as_mitsuba_does(scene: Scene, relit: Relit) -> None:
    heights = waves(SIDE, 1.5).numpy()
    ours = relit.sunlit(heights, TOWARD) + AMBIENT * relit.skylit(heights, 0, azimuths=64)
    renders = np.stack([scene.render(heights, samples=256, seed=seed).numpy() for seed in range(4)])
    mean = renders.mean(0)
    noise = renders.std(0, ddof=1).mean() / 2.0
    assert np.abs(ours - mean).mean() < 0.003 * mean.mean() + 2.0 * noise
    assert abs(ours.mean() / mean.mean() - 1.0) < 0.002


def test_what_shadow_rays_are_saved_changes_no_more_than_their_number(relit: Relit, scene: Scene) -> None:
    heights = waves(SIDE, 2.5).numpy()
    few, many = relit.sunlit(heights, TOWARD), Relit(scene, strata=24, seed=1).sunlit(heights, TOWARD)
    assert np.sqrt(np.mean((few - many) ** 2)) < 0.01 * many.mean()


def test_azimuths_are_unbiased(relit: Relit) -> None:
    heights = waves(SIDE, 2.5).numpy()
    few = np.mean([relit.skylit(heights, seed, azimuths=4) for seed in range(16)], axis=0)
    many = relit.skylit(heights, 99, azimuths=64)
    assert abs(few.mean() / many.mean() - 1.0) < 0.002
    assert np.sqrt(np.mean((few - many) ** 2)) < 0.01 * many.mean()


def test_the_same_seed_is_the_same_picture(relit: Relit) -> None:
    first, second = waves(SIDE, 2.5).numpy(), waves(SIDE, 1.0, seed=3).numpy()
    before = relit.sunlit(first, TOWARD), relit.skylit(first, 5)
    relit.sunlit(second, TOWARD[:1])
    np.testing.assert_array_equal(relit.sunlit(first, TOWARD), before[0])
    np.testing.assert_array_equal(relit.skylit(first, 5), before[1])


def test_another_camera_is_refused(scene: Scene) -> None:
    other = Scene(check_scene(STUDIO, {"resolution": "16"}), np.zeros((SIDE, SIDE)), "llvm_ad_mono")
    with pytest.raises(ValueError, match="straight down"):
        Relit(other)
    with pytest.raises(ValueError, match="strata"):
        Relit(scene, strata=2)
