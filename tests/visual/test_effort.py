"""Effort of a picture: rendered in passes where it is large, refused in one line where it would take days."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from relief.ground.errors import InputError
from tests.visual.differences import DIRECTIONS
from tests.visual.exact.test_view import CAMERAS
from tests.visual.scenes import CUBE, FLOOR, SIDE, Array, sun
from visual.exact import render
from visual.explain import explain_scene
from visual.scene import Scene


def picture_and_gradient(scene: Scene, samples: int) -> tuple[Array, Array]:
    heights = torch.tensor(scene.heights, requires_grad=True)
    picture = scene.render(heights, samples=samples)
    picture.square().sum().backward()
    assert heights.grad is not None
    return picture.detach().numpy(), heights.grad.numpy()


@pytest.mark.slow
def test_a_large_picture_is_rendered_in_passes(
    scene_of: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = scene_of(sun(35))
    whole = picture_and_gradient(scene, 100)
    monkeypatch.setattr(render, "LARGEST_PASS", 32 * SIDE**2 + 1)
    parts = picture_and_gradient(scene, 100)
    monkeypatch.setattr(render, "LARGEST_PASS", 1)
    for one, other in zip(whole, parts, strict=True):
        assert np.linalg.norm(one - other) > 0.0
    assert np.abs(whole[0] - parts[0]).mean() < 0.02 * whole[0].mean()
    slopes = [np.tensordot(DIRECTIONS, gradient, 2) for _, gradient in (whole, parts)]
    assert np.linalg.norm(slopes[0] - slopes[1]) < 0.2 * np.linalg.norm(slopes[0])
    monkeypatch.setattr(render, "LARGEST_PASS", 1)
    assert abs(picture_and_gradient(scene, 2)[0].mean() / whole[0].mean() - 1.0) < 0.05


def test_samples_that_take_days_are_refused_before_anything_is_rendered(
    scene_of: Callable[..., Scene], tmp_path: Path
) -> None:
    scene = scene_of(sun(35), rows=2048, cols=2048)
    line = r"scene\.xml: samples: 65536 on each of 2048 x 2048 pixels are 2\.75e\+11, more than 6\.87e\+10"
    with pytest.raises(InputError, match=line):
        scene.render(samples=65536)
    with pytest.raises(InputError, match=line):
        explain_scene(tmp_path / "scene.xml", samples=65536)
    with pytest.raises(
        InputError, match=r"film: 2048 x 2048 pixels; steps keep 6\.71e\+07 samples in memory"
    ):
        scene.views()
    explain_scene(tmp_path / "scene.xml")


@pytest.mark.parametrize(
    ("more", "camera", "refused"),
    [(CUBE, {}, True), (FLOOR, {}, False), (CUBE, CAMERAS["orthographic"], True), ("", {}, False)],
    ids=["cube above", "table below", "cube from the side", "alone"],
)
def test_explain_and_gradients_agree_on_what_hides_the_plate(
    scene_of: Callable[..., Scene], tmp_path: Path, more: str, camera: dict[str, str], refused: bool
) -> None:
    scene = scene_of(sun(35), more=more, **camera)
    sentence = dict(explain_scene(tmp_path / "scene.xml"))["gradients"]
    assert sentence.startswith("none") == refused
    if not refused:
        scene.views()
        return
    with pytest.raises(InputError) as caught:
        scene.views()
    assert str(caught.value).split(": ", 1)[1] in sentence
