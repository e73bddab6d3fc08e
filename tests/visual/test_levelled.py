"""A relief that is lifted as a whole looks the same from the side."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

from optimize.descent.gauss_newton.step_look import StepLook
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from relief.relief import Relief
from tactile import Skin
from tests.visual.scenes import FLOOR, SIDE, SIZE_MM, hills, sun
from visual.scene import Scene, load_scene

ASLANT = '<scale x="8" y="8"/><lookat origin="0, -20, 20" target="0, 0, 0" up="0, 0, 1"/>'


def from_the_side(scene_of: Callable[..., Scene], **written: Any) -> Scene:
    return scene_of(sun(50.0), camera=ASLANT, **written)


def test_lifts_do_not_show_from_the_side(scene_of: Callable[..., Scene]) -> None:
    scene = from_the_side(scene_of)
    original = scene.render(samples=4)
    lifted, other = scene.heights + 0.2, 1.1 * scene.heights
    assert np.abs((scene.render(lifted, samples=4) - original).numpy()).mean() > 0.01 * original.mean()
    levelled = scene.render(scene.levelled(lifted), samples=4)
    np.testing.assert_allclose(levelled.numpy(), original.numpy(), atol=1e-3 * float(original.max()))
    assert scene.levelled(other).mean() == pytest.approx(scene.heights.mean())
    tensor = torch.as_tensor(np.stack([lifted, other]), dtype=torch.float64)
    assert torch.allclose(scene.levelled(tensor)[1], torch.as_tensor(scene.levelled(other)))


def test_from_straight_above_beside_other_shapes_and_above_3_mm_heights_stay(
    scene_of: Callable[..., Scene],
) -> None:
    above = scene_of(sun(50.0))
    deep = hills()
    deep *= 4.0 / deep.max()
    for scene in (above, from_the_side(scene_of, more=FLOOR), from_the_side(scene_of, heights=deep)):
        lifted = scene.heights + 0.2
        assert scene.levelled(lifted) is lifted


@pytest.mark.slow
def test_steps_do_not_see_lifts() -> None:
    scene = load_scene("five_views", {"resolution": str(SIDE)}, relief=Relief(hills(0.6), SIZE_MM))
    look = StepLook(Problem(scene.relief, Skin(), Targets.of(0.01, roughness=0.1), scene))
    same, lifted = (look.evaluate(scene.heights + lift) for lift in (0.0, 0.1))
    for one, other in zip(same, lifted, strict=True):
        np.testing.assert_allclose(one.pictures, other.pictures, atol=2e-3 * one.pictures.max())
