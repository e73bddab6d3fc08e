"""The fast look on any number of height samples and pixels."""

from collections.abc import Callable

import numpy as np
import pytest
import torch

from tests.recorded import Truths
from tests.tactile.reliefs import waves
from tests.visual.differences import pictures_of_mitsuba
from tests.visual.scenes import IRRADIANCE, PLASTIC, SIDE, sky, sun
from visual.fast.renderer import box_weights
from visual.scene import Scene


@pytest.mark.parametrize("pixels", [16, 24, 48, 64])
def test_films_of_any_size_take_means_of_quarters(
    scene_of: Callable[..., Scene], truths: Truths, pixels: int
) -> None:
    heights = waves(SIDE, 1.0).numpy()
    scene = scene_of(sun(35), heights=heights, rows=pixels, cols=pixels)
    theirs = pictures_of_mitsuba(truths, scene, 1024).mean
    field = torch.tensor(heights, requires_grad=True)
    ours = scene.render(field, model="fast")
    assert np.abs(ours.detach().numpy() - theirs).mean() < 0.02 * theirs.mean()
    ours.square().sum().backward()
    assert field.grad is not None and bool(field.grad.abs().sum() > 0)


@pytest.mark.parametrize("pixels", [1, 7, 32, 64, 100])
def test_weights_of_a_film_are_shares_of_area(pixels: int) -> None:
    weights = box_weights(pixels, SIDE).of_quarters
    np.testing.assert_allclose(weights.sum(1), 1.0)
    np.testing.assert_allclose(weights.sum(0), pixels / (2 * SIDE))


@pytest.mark.slow
@pytest.mark.parametrize("samples", [20, 64, 100])
def test_ambient_light_is_that_of_mitsuba_on_every_grid(scene_of: Callable[..., Scene], samples: int) -> None:
    """By the net that comes with the package, which was trained on 128 samples."""
    heights = waves(samples, 1.0).numpy()
    scene = scene_of(sky(IRRADIANCE), heights=heights, material=PLASTIC, rows=samples, cols=samples)
    theirs = scene.render(samples=256).numpy()
    ours = scene.render(model="fast").numpy()
    assert abs(ours.mean() / theirs.mean() - 1.0) < 0.02
    assert np.abs(ours - theirs).mean() < 0.04 * theirs.mean()
