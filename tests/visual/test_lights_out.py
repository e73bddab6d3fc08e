"""Lights that are put out: pictures of a scene that several lights share are those of each light alone."""

from collections.abc import Callable

import numpy as np
import pytest
import torch

from tests.visual.scenes import PANEL, hills, sky, sun
from visual.exact.render import RenderSettings, light_pictures
from visual.scene import Scene

SETTINGS = RenderSettings(samples=4, seed=3, shadow_edges=False)
LIGHTS = (sun(35), sun(50, 100.0, "a.b"), sun(20, 200.0), sky())


@pytest.mark.slow
def test_each_light_gives_the_picture_that_it_gives_alone(scene_of: Callable[..., Scene]) -> None:
    together = scene_of(*LIGHTS).light_scenes()
    assert len({id(light.scene) for light in together}) == 1
    for number in (3, 0, 2, 1):
        (alone,) = scene_of(LIGHTS[number]).light_scenes()
        found, expected = (
            light_pictures(light, 0.8 * hills(), SETTINGS, number) for light in (together[number], alone)
        )
        np.testing.assert_array_equal(found, expected)


@pytest.mark.slow
def test_a_gradient_is_that_of_the_light_alone(scene_of: Callable[..., Scene]) -> None:
    gradients = []
    for scene in (scene_of(sun(35), sun(50, 100.0)), scene_of(sun(35))):
        heights = torch.tensor(hills(), requires_grad=True)
        scene.render(heights, samples=4, seed=1)[0].sum().backward()
        gradients.append(heights.grad)
    assert gradients[0] is not None and gradients[1] is not None
    # Not bit for bit: threads add up in any order.
    torch.testing.assert_close(*gradients, rtol=1e-4, atol=1e-4)


@pytest.mark.slow
def test_pictures_of_another_resolution_share_the_scene(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35), sky())
    first = scene.render(samples=4)
    assert scene.render(samples=4, resolution=16).shape[-2:] == (16, 16)
    assert torch.equal(scene.render(samples=4), first)


def test_the_background_is_that_of_the_light_whatever_shone_last(scene_of: Callable[..., Scene]) -> None:
    scene, down = scene_of(sun(35), sky(0.3)), np.array([[0.0, 0.0, -1.0]])
    by_sun, by_sky = scene.light_scenes()
    light_pictures(by_sun, hills(), SETTINGS, 0)
    np.testing.assert_allclose(by_sky.background(down), 0.3, rtol=1e-6)
    np.testing.assert_array_equal(by_sun.background(down), 0.0)


def test_a_surface_that_shines_keeps_a_scene_of_its_own(scene_of: Callable[..., Scene]) -> None:
    scenes = scene_of(sun(35), sun(50, 100.0), more=PANEL).light_scenes()
    assert len(scenes) == 3 and len({id(light.scene) for light in scenes}) == 2
