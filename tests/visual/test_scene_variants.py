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
from scipy.ndimage import gaussian_filter

from relief.ground.errors import InputError
from tests.visual.differences import ADJOINTS, differ_by_noise
from tests.visual.exact.test_view import OBLIQUE
from tests.visual.scenes import MATTE, PLASTIC, Array, hills, sky, sun, write_scene
from visual.explain import explain_scene
from visual.scene import Scene, load_scene
from visual.scene_looks import FastLook

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_every_variant_shows_the_same_pictures(scene_of: Callable[..., Scene], variant: str) -> None:
    seeds = range(12)
    reference = scene_of(sun(35), sky(), material=PLASTIC, variant="llvm_ad_mono")
    expected = [reference.render(seed=seed).numpy()[0] for seed in seeds]
    # Seeds of its own, as one variant's random numbers may be another's.
    scene = scene_of(sun(35), sky(), material=PLASTIC, variant=variant)
    assert scene.variant == variant
    assert differ_by_noise([scene.render(seed=100 + seed).numpy()[0] for seed in seeds], expected)


@pytest.mark.slow
@pytest.mark.gradients
def test_in_every_variant_explicit_pictures_are_the_rendered_ones(
    scene_of: Callable[..., Scene], variant: str
) -> None:
    scene, seeds = scene_of(sun(35), material=PLASTIC, variant=variant), range(12)
    ours = [scene.views(seed=seed)[0].evaluate(scene.heights, False).pictures[0] for seed in seeds]
    assert differ_by_noise(ours, [scene.render(seed=seed).numpy()[0] for seed in seeds])


@pytest.mark.slow
@pytest.mark.gradients
def test_in_every_variant_the_gradient_is_that_of_the_explicit_jacobian(
    scene_of: Callable[..., Scene], variant: str
) -> None:
    scene, seeds = scene_of(sun(35), material=PLASTIC, variant=variant), range(3)
    rendered, explicit = np.zeros(scene.heights.shape), np.zeros(scene.heights.size)
    for seed in seeds:
        heights = torch.tensor(scene.heights, requires_grad=True)
        (scene.render(heights, seed=seed)[0] * torch.as_tensor(ADJOINTS[0])).sum().backward()
        assert heights.grad is not None
        rendered += heights.grad.numpy()
        explicit += scene.views(seed=seed)[0].evaluate(scene.heights).jacobians[0].T @ ADJOINTS[0].ravel()
    one, other = (gaussian_filter(g.reshape(rendered.shape), 2.0) for g in (rendered, explicit))
    assert float((one * other).sum() / np.linalg.norm(one) / np.linalg.norm(other)) > 0.97


@pytest.mark.parametrize(
    "variant", ["scalar_rgb", "scalar_spectral", "llvm_ad_spectral", "llvm_ad_mono_polarized"]
)
def test_other_variants_only_render(scene_of: Callable[..., Scene], tmp_path: Path, variant: str) -> None:
    scene = scene_of(sun(35), pixel_format="rgb", variant=variant)
    expected = scene_of(sun(35)).render().numpy().mean()
    assert scene.render(samples=16).numpy().mean() == pytest.approx(expected, rel=0.02)
    refused = rf"variant: {variant} has no gradients of pictures; name no variant, or llvm_ad_mono"
    heights = torch.tensor(scene.heights, requires_grad=True)
    for wanted in (scene.views, lambda: FastLook(scene).renderer, lambda: scene.render(heights)):
        with pytest.raises(InputError, match=refused):
            wanted()
    lines = dict(explain_scene(tmp_path / "scene.xml", variant=variant))
    assert all(refused in lines[line] for line in ("gradients", "fast look"))


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("variant", ["scalar_rgb", None], ids=["asked for", "no libLLVM"])
def test_without_llvm_there_are_pictures_and_no_gradients(
    scene_of: Callable[..., Scene], tmp_path: Path, variant: str | None
) -> None:
    loaded = scene_of(sun(35), sky())
    script = f"""
import numpy as np, torch
from visual.backend import llvm
def missing():
    raise llvm.LLVMMissing("no libLLVM")
if {variant!r} is None:
    llvm.prepare = missing
from relief.ground.errors import InputError
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


def test_weights_of_the_plate_after_another_scene_in_colour_leave_a_scene_that_renders(
    tmp_path: Path,
) -> None:
    """As measures of studies do, which look at one result in many scenes."""
    path = write_scene(tmp_path, hills(0.5), [sun(35)], camera=OBLIQUE)
    grey = load_scene(path, variant="llvm_ad_mono")
    load_scene(path, variant="llvm_ad_rgb").render(samples=1)
    assert grey.plate_weights(48).shape == (1, 48, 48)
    assert {light.lit.variant for light in grey.light_scenes(48)} == {"llvm_ad_mono"}
    assert grey.render(samples=1, resolution=48).mean() > 0.0
