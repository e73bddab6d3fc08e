"""Pictures in closed form are those that Mitsuba's samples converge to."""

from pathlib import Path

import numpy as np
import pytest

from relief.relief import Relief
from tests.tactile.reliefs import waves
from visual.reference.reference_renderer import ReferenceRenderer
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
    return Scene(checked, Relief(np.zeros((SIDE, SIDE))), "llvm_ad_mono")


@pytest.fixture(scope="module")
def renderer(scene: Scene) -> ReferenceRenderer:
    return ReferenceRenderer(scene)


def test_a_flat_plate_is_as_bright_everywhere(renderer: ReferenceRenderer) -> None:
    flat = np.zeros((SIDE, SIDE))
    parallel, ambient = renderer.parallel_pictures(flat, TOWARD), renderer.ambient_picture(flat, 0)
    np.testing.assert_allclose(parallel, parallel[0, 0, 0], rtol=1e-5)
    np.testing.assert_allclose(ambient, ambient.mean(), rtol=2e-3)
    assert 0.2 < parallel.mean() < 0.5


@pytest.mark.slow
def test_the_studio_is_rendered_as_mitsuba_does(scene: Scene, renderer: ReferenceRenderer) -> None:
    heights = waves(SIDE, 1.5).numpy()
    ours = renderer.parallel_pictures(heights, TOWARD) + AMBIENT * renderer.ambient_picture(
        heights, 0, azimuths=64
    )
    renders = np.stack([scene.render(heights, samples=256, seed=seed).numpy() for seed in range(4)])
    mean = renders.mean(0)
    noise = renders.std(0, ddof=1).mean() / 2.0
    assert np.abs(ours - mean).mean() < 0.003 * mean.mean() + 2.0 * noise
    assert abs(ours.mean() / mean.mean() - 1.0) < 0.002


def test_what_shadow_rays_are_saved_changes_no_more_than_their_number(
    renderer: ReferenceRenderer, scene: Scene
) -> None:
    heights = waves(SIDE, 2.5).numpy()
    few, many = (
        renderer.parallel_pictures(heights, TOWARD),
        ReferenceRenderer(scene, strata=24, seed=1).parallel_pictures(heights, TOWARD),
    )
    assert np.sqrt(np.mean((few - many) ** 2)) < 0.01 * many.mean()


def test_azimuths_are_unbiased(renderer: ReferenceRenderer) -> None:
    heights = waves(SIDE, 2.5).numpy()
    few = np.mean([renderer.ambient_picture(heights, seed, azimuths=4) for seed in range(16)], axis=0)
    many = renderer.ambient_picture(heights, 99, azimuths=64)
    assert abs(few.mean() / many.mean() - 1.0) < 0.002
    assert np.sqrt(np.mean((few - many) ** 2)) < 0.01 * many.mean()


def test_the_same_seed_is_the_same_picture(renderer: ReferenceRenderer) -> None:
    first, second = waves(SIDE, 2.5).numpy(), waves(SIDE, 1.0, seed=3).numpy()
    before = renderer.parallel_pictures(first, TOWARD), renderer.ambient_picture(first, 5)
    renderer.parallel_pictures(second, TOWARD[:1])
    np.testing.assert_array_equal(renderer.parallel_pictures(first, TOWARD), before[0])
    np.testing.assert_array_equal(renderer.ambient_picture(first, 5), before[1])


def test_another_camera_is_refused(scene: Scene) -> None:
    other = Scene(check_scene(STUDIO, {"resolution": "16"}), Relief(np.zeros((SIDE, SIDE))), "llvm_ad_mono")
    with pytest.raises(ValueError, match="straight down"):
        ReferenceRenderer(other)
    with pytest.raises(ValueError, match="strata"):
        ReferenceRenderer(scene, strata=2)


def test_a_tile_is_refused() -> None:
    checked = check_scene(STUDIO, {"resolution": str(SIDE)})
    tile = Scene(checked, Relief(np.zeros((SIDE, SIDE)), repeats=(False, True)), "llvm_ad_mono")
    with pytest.raises(ValueError, match="end at its sides"):
        ReferenceRenderer(tile)
