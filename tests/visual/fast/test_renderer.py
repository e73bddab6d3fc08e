"""The fast renderer: near Mitsuba's pictures, and refused where it cannot show a scene."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from relief.ground.errors import InputError
from relief.surface import Surface
from tests.recorded import Truths
from tests.tactile.reliefs import waves
from tests.visual.differences import pictures_of_mitsuba
from tests.visual.scenes import CUBE, FLOOR, LOW, sun
from visual.fast.bsdf_table import BsdfTable
from visual.fast.jacobian import FastView
from visual.fast.refinement import pixel_means
from visual.fast.renderer import FastRenderer
from visual.scene import Scene

SIDE = 32
POINT = '<emitter type="point"><point name="position" x="3" y="2" z="9"/></emitter>'
NEAR_ABOVE = '<lookat origin="-1, -1, 30" target="0, 0, 0" up="0, 1, 0"/>'
SPECTRAL = '<emitter type="constant"><spectrum name="radiance" value="400:0.1, 700:0.4"/></emitter>'


@pytest.mark.slow
def test_pictures_are_near_those_of_mitsuba(scene: Scene, with_net: None) -> None:
    """With a net that corrects nothing: most of the difference is what a trained net corrects."""
    heights = waves(SIDE, 1.0).numpy()
    ours, theirs = (scene.render(heights, samples=1024, model=model).numpy() for model in ("fast", "exact"))
    assert ours.shape == theirs.shape
    assert np.abs(ours - theirs).mean() < 0.05 * theirs.mean()
    flat = np.zeros((SIDE, SIDE))
    np.testing.assert_allclose(
        scene.render(flat, model="fast").numpy(), scene.render(flat, samples=4096).numpy(), rtol=0.02
    )


def test_pictures_under_parallel_lights_are_those_of_mitsuba(
    two_lights: FastRenderer, scene_of: Callable[..., Scene], truths: Truths
) -> None:
    heights = waves(SIDE, 1.5).numpy()
    scene = scene_of(sun(35.0, 20.0), sun(50.0, 145.0), heights=heights)
    theirs = pictures_of_mitsuba(truths, scene, 1024).mean
    ours = two_lights.pictures(torch.as_tensor(heights)).numpy()
    assert np.abs(ours - theirs).mean() < 0.012 * theirs.mean()


@pytest.mark.parametrize(
    ("written", "message"),
    [
        ({"rows": 2 * SIDE, "cols": 2 * SIDE, "rfilter": "tent"}, "film: rfilter: .* one pixel at each"),
        ({"camera": LOW}, "sensor: .* at most 70 degrees off straight above"),
        ({"camera": NEAR_ABOVE, "kind": "perspective"}, "sensor: .* from a side, not from over the plate"),
        ({"max_depth": 3}, "direct light only"),
        ({"more": FLOOR}, "shape: the fast look knows no shape but the plate"),
        ({"more": CUBE}, "shape: the fast look knows no shape but the plate"),
        ({"further": SPECTRAL, "pixel_format": "rgb"}, "constant: radiance: .* rgb colour"),
        ({"further": POINT}, "point: .*the fast look shows no other"),
    ],
)
def test_scenes_beyond_the_fast_renderer_are_refused_in_one_line(
    written: dict[str, Any], message: str, scene_of: Callable[..., Scene]
) -> None:
    scene = scene_of(sun(35.0), heights=np.zeros((SIDE, SIDE)), **written)
    with pytest.raises(InputError, match=rf'scene\.xml: .*{message}.*; use look.model = "exact"$'):
        scene.render(model="fast")


def test_a_light_straight_above_casts_no_shadow() -> None:
    table = BsdfTable(torch.ones(1, 8, 8, dtype=torch.float64))
    look = FastRenderer(Surface((SIDE, SIDE), 10.0), ((0.0, 0.0, 1.0),), (0,), 1, table, None)
    heights = waves(SIDE, 2.0)
    torch.testing.assert_close(look.pictures(heights), torch.ones(1, SIDE, SIDE, dtype=torch.float64))
    np.testing.assert_allclose(FastView(look).evaluate(heights.numpy()).pictures, 1.0)


@pytest.mark.slow
def test_pictures_and_gradients_take_no_mitsuba() -> None:
    script = """
import sys, torch
from relief.surface import Surface
from visual.fast.renderer import FastRenderer
from visual.fast.jacobian import FastView
from visual.fast.bsdf_table import BsdfTable
table = BsdfTable(torch.rand(1, 16, 16))
look = FastRenderer(Surface((16, 16), 10.0), ((0.6, 0.0, 0.8),), (0,), 1, table, None)
heights = torch.rand(16, 16, dtype=torch.float64, requires_grad=True)
look.pictures(heights).sum().backward()
FastView(look).evaluate(heights.detach().numpy())
print(*({"mitsuba", "drjit"} & sys.modules.keys()))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""


def test_batches_have_a_picture_each(two_lights: FastRenderer) -> None:
    both = torch.stack((waves(SIDE, 1.5), waves(SIDE, 0.5)))
    pictures = two_lights.pictures(both)
    assert pictures.shape == (2, 2, SIDE, SIDE)
    torch.testing.assert_close(pictures[1], two_lights.pictures(both[1]))
    assert pixel_means(pictures).shape == (2, 2, SIDE // 2, SIDE // 2)


def test_an_unknown_look_is_refused(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35.0), heights=waves(SIDE, 1.5).numpy())
    with pytest.raises(InputError, match=r'^look\.model: "quick" is not one of exact, fast'):
        scene.render(model="quick")
