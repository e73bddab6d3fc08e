"""A scene in Mitsuba's variants: grey, in colour, and without gradients."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from tests.visual.differences import differ_by_noise
from tests.visual.scenes import MATTE, PLASTIC, Array, hills, sky, sun
from visual.scene import Scene

ROOT = Path(__file__).resolve().parents[2]


def test_a_grey_scene_in_colour_has_the_same_pictures(scene_of: Callable[..., Scene]) -> None:
    grey = scene_of(sun(35), material=PLASTIC)
    in_colour = scene_of(sun(35), material=PLASTIC, variant="llvm_ad_rgb")
    assert (grey.variant, in_colour.variant) == ("llvm_ad_mono", "llvm_ad_rgb")
    seeds = range(12)
    ours, theirs = ([s.render(seed=seed).numpy()[0] for seed in seeds] for s in (grey, in_colour))
    assert differ_by_noise(ours, theirs)


def test_scenes_in_different_variants_do_not_disturb_each_other(scene_of: Callable[..., Scene]) -> None:
    def gradient(loaded: Scene, before_backward: Callable[[], Any]) -> Array:
        heights = torch.tensor(hills(), requires_grad=True)
        loss = loaded.render(heights, samples=4).sum()
        before_backward()
        loss.backward()
        assert heights.grad is not None
        return heights.grad.numpy()

    grey = scene_of(sun(35))
    picture, view = grey.render(), grey.views()[0]
    alone, samples = gradient(grey, lambda: None), view.evaluate(grey.heights).pictures
    others = [scene_of(sun(35), variant=variant) for variant in ("llvm_ad_rgb", "scalar_rgb")]
    for other in others:
        np.testing.assert_allclose(other.render().mean(), picture.mean(), rtol=0.01)
        assert torch.equal(grey.render(), picture)
        np.testing.assert_allclose(gradient(grey, other.render), alone, atol=1e-4 * np.abs(alone).max())
        other.render()
        np.testing.assert_array_equal(view.evaluate(grey.heights).pictures, samples)


RED, GREENISH = "3, 0.5, 0.2", "0.2, 0.7, 0.4"


@pytest.mark.parametrize(
    ("light", "material"),
    [
        (sun(35, irradiance=RED), MATTE),
        (sun(35), f'<bsdf type="diffuse"><rgb name="reflectance" value="{GREENISH}"/></bsdf>'),
        (
            sun(35, irradiance=RED),
            f'<bsdf type="diffuse"><rgb name="reflectance" value="{GREENISH}"/></bsdf>',
        ),
    ],
    ids=["light", "material", "both"],
)
def test_coloured_pictures_count_by_their_luminance(
    scene_of: Callable[..., Scene], light: str, material: str
) -> None:
    loaded = scene_of(light, material=material, pixel_format="rgb")
    assert loaded.variant == "llvm_ad_rgb"
    seeds = range(12)
    ours = [loaded.views(seed=seed)[0].evaluate(loaded.heights, False).pictures[0] for seed in seeds]
    assert differ_by_noise(ours, [loaded.render(seed=seed).numpy()[0] for seed in seeds])


def test_the_white_of_a_coloured_light_is_its_luminance(scene_of: Callable[..., Scene]) -> None:
    luminance = 3 * 0.212671 + 0.5 * 0.715160 + 0.2 * 0.072169
    assert scene_of(sun(35, irradiance=RED)).white == pytest.approx(luminance / np.pi, rel=1e-4)


@pytest.mark.parametrize("variant", ["scalar_rgb", None], ids=["asked for", "no libLLVM"])
def test_without_llvm_there_are_pictures_and_no_gradients(
    scene_of: Callable[..., Scene], tmp_path: Path, variant: str | None
) -> None:
    loaded = scene_of(sun(35), sky())
    script = f"""
import numpy as np, torch
from visual import llvm
def missing():
    raise llvm.LLVMMissing("no libLLVM")
if {variant!r} is None:
    llvm.prepare = missing
from visual.errors import InputError
from visual.scene import load_scene
scene = load_scene("scene.xml", variant={variant!r})
assert scene.variant == "scalar_rgb"
np.save("pictures.npy", scene.render(samples=16).numpy())
for wanted in (scene.views, lambda: scene.render(torch.zeros(scene.heights.shape, requires_grad=True))):
    try:
        wanted()
    except InputError as error:
        print(error)
"""
    search = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    ran = subprocess.run(
        [sys.executable, "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": search},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert ran.returncode == 0, ran.stderr
    lines = ran.stdout.splitlines()
    assert len(lines) == 2
    assert all("has no gradients" in line for line in lines)
    pictures, expected = np.load(tmp_path / "pictures.npy"), loaded.render(samples=256).numpy()
    assert pictures.shape == expected.shape
    assert np.abs(pictures - expected).mean() < 0.1 * expected.mean()
    assert pictures.mean() == pytest.approx(expected.mean(), rel=0.01)
