"""Pictures of two reliefs: light by light, until their change is known."""

from collections.abc import Callable

import numpy as np
import pytest

from optimize.verification.converged import LEAST_SAMPLES, change_from, converged
from tests.visual.scenes import hills, sky, sun
from visual.picture_noise import BATCHES, Batches
from visual.scene import Scene

SceneOf = Callable[..., Scene]
FLATTER = 0.9


def never(before: Batches, after: Batches) -> bool:
    return False


def at_once(before: Batches, after: Batches) -> bool:
    return True


@pytest.mark.slow
@pytest.mark.parametrize("lights", [(sun(35), sun(50, 100.0), sky()), (sun(35),), (sky(),)])
def test_the_pictures_are_those_of_the_scene(scene_of: SceneOf, lights: tuple[str, ...]) -> None:
    scene = scene_of(*lights)
    before, after = converged(scene, scene.heights, FLATTER * scene.heights, never, most=256)
    assert before.samples == after.samples == 256 and len(before.pictures) == BATCHES
    for found, heights in ((before, scene.heights), (after, FLATTER * scene.heights)):
        expected = scene.render(heights, samples=1024).numpy()
        assert found.mean.shape == expected.shape
        error = np.sqrt(np.square(found.mean - expected).mean())
        assert error < 1.5 * np.sqrt(np.square(found.standard_error).mean()) + 1e-6


@pytest.mark.slow
def test_it_ends_as_soon_as_the_change_is_known(scene_of: SceneOf) -> None:
    scene = scene_of(sun(35), sky())
    before, _ = converged(scene, scene.heights, FLATTER * scene.heights, at_once)
    assert before.samples == LEAST_SAMPLES


@pytest.mark.slow
def test_the_light_with_the_most_noise_gets_the_samples(scene_of: SceneOf) -> None:
    """A faint sun over a bright sky: its noise does not count, and it keeps its first samples."""
    scene = scene_of(sun(35, irradiance=1e-3), sky(3.0))
    rounds: list[Batches] = []

    def third(before: Batches, after: Batches) -> bool:
        rounds.append(before)
        return len(rounds) == 3

    before, _ = converged(scene, scene.heights, FLATTER * scene.heights, third)
    assert before.samples == LEAST_SAMPLES
    errors = [float(np.sqrt(np.square(one.standard_error).mean())) for one in rounds]
    assert errors[2] < 0.7 * errors[0]


@pytest.mark.slow
def test_two_reliefs_share_their_random_numbers(scene_of: SceneOf) -> None:
    scene = scene_of(sun(35), sky())
    before, after = converged(scene, scene.heights, scene.heights, at_once)
    np.testing.assert_array_equal(before.pictures, after.pictures)
    again, _ = converged(scene, scene.heights, FLATTER * hills(), at_once)
    np.testing.assert_array_equal(again.pictures, before.pictures)
    other, _ = converged(scene, scene.heights, scene.heights, at_once, seed=1)
    assert (other.pictures != before.pictures).any()


@pytest.mark.slow
def test_a_change_takes_the_random_numbers_of_the_pictures_before(scene_of: SceneOf) -> None:
    scene = scene_of(sun(35), sky())
    before, after = converged(scene, scene.heights, FLATTER * scene.heights, never, seed=2, most=256)
    assert before.first is not None and before.first_samples == LEAST_SAMPLES
    assert not change_from(scene, before, scene.heights, samples=32, seed=2).any()
    few = change_from(scene, before, FLATTER * scene.heights, samples=32, seed=2)
    change = after.mean - before.mean
    # A change by other random numbers would have this error, of the pictures' own noise.
    noise = np.sqrt(np.square(before.standard_error).mean() * before.samples / 32)
    assert np.sqrt(np.square(few - change).mean()) < 0.9 * noise


@pytest.mark.slow
def test_the_samples_can_be_given(scene_of: SceneOf) -> None:
    scene = scene_of(sun(35), sky())
    for wanted, samples in ((1, BATCHES), (16, 16)):
        before, after = converged(scene, scene.heights, scene.heights, never, most=wanted, least=wanted)
        assert before.samples == after.samples == samples
