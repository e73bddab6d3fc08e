"""A scene as conditions: what is rendered, what is not, and what is refused."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch

from tests.visual.scenes import (
    ALBEDO,
    IRRADIANCE,
    MATTE,
    PLASTIC,
    RADIANCE,
    SIDE,
    SIZE_MM,
    Array,
    hills,
    sky,
    sun,
    write_scene,
)
from visual import exact, scene
from visual.check import check_scene, instantiate
from visual.errors import InputError
from visual.scene import Scene, load_scene

ROOT = Path(__file__).resolve().parents[2]
POINT = '<emitter type="point"><point name="position" x="3" y="2" z="9"/></emitter>'


@pytest.fixture
def scene_of(mi: ModuleType, tmp_path: Path) -> Callable[..., Scene]:
    def make(*lights: str, heights: Array | None = None, variant: str | None = None, **written: Any) -> Scene:
        relief = hills() if heights is None else heights
        return load_scene(write_scene(tmp_path, relief, lights, **written), variant=variant)

    return make


def z_squared(one: list[Array], other: list[Array]) -> float:
    """Mean square of the difference of two sets of pictures in units of its standard error."""
    variance = np.var(one, axis=0, ddof=1) / len(one) + np.var(other, axis=0, ddof=1) / len(other)
    variance += (1e-5 * np.mean(one)) ** 2
    return float(((np.mean(one, axis=0) - np.mean(other, axis=0)) ** 2 / variance).mean())


def test_every_light_is_a_condition_and_ambient_light_is_in_all(scene_of: Callable[..., Scene]) -> None:
    names = scene_of(sun(35, name="left"), sky(), sun(40, 200), sun(50, 100, name="back")).conditions
    assert names == ("left", "light-2", "back")
    assert scene_of(sky()).conditions == ("ambient",)


def test_a_scene_knows_its_plate_and_its_pictures(scene_of: Callable[..., Scene]) -> None:
    loaded = scene_of(sun(35), sun(35, irradiance=0.1), sky())
    np.testing.assert_array_equal(loaded.heights, hills())
    assert (loaded.size_mm, loaded.resolution, loaded.samples) == (SIZE_MM, (SIDE, SIDE), 64)
    assert loaded.white == pytest.approx(IRRADIANCE / np.pi)
    assert scene_of(sky()).white == pytest.approx(RADIANCE)
    assert loaded.render().shape == (2, SIDE, SIDE)


def test_a_flat_plate_is_as_bright_as_its_lights_say(scene_of: Callable[..., Scene]) -> None:
    flat = np.full((SIDE, SIDE), 0.5)
    pictures = scene_of(sun(35), sun(90), sky(), heights=flat).render(samples=256).numpy()
    suns = np.sin(np.radians([35, 90])) * IRRADIANCE / np.pi
    np.testing.assert_allclose(pictures.mean((1, 2)), ALBEDO * (suns + RADIANCE), rtol=2e-3)


def test_lights_rendered_alone_add_up_to_all_of_them_together(
    mi: ModuleType, scene_of: Callable[..., Scene], tmp_path: Path
) -> None:
    apart = scene_of(sun(35), sun(40, 200), material=PLASTIC)
    together = instantiate(check_scene(tmp_path / "scene.xml"))
    seeds = range(16)
    sums = [apart.render(seed=seed).sum(0).numpy() for seed in seeds]
    whole = [np.array(mi.render(together, spp=64, seed=seed))[..., 0] for seed in seeds]
    assert z_squared(sums, whole) < 1.2 * 15 / 13


def test_ambient_light_adds_the_same_to_every_condition(scene_of: Callable[..., Scene]) -> None:
    with_sky = scene_of(sun(35), sun(40, 200), sky()).render()
    around = with_sky - scene_of(sun(35), sun(40, 200)).render()
    torch.testing.assert_close(around[0], around[1])
    assert float(around.mean()) == pytest.approx(float(scene_of(sky()).render(seed=1).mean()), rel=0.01)


@pytest.mark.parametrize(
    ("lights", "count"), [((sun(35), sun(40, 200)), 2), ((sun(35), sun(40, 200), sky()), 3), ((sky(),), 1)]
)
def test_nothing_is_rendered_or_made_that_is_not_needed(
    scene_of: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch, lights: tuple[str, ...], count: int
) -> None:
    made, rendered = [], []
    make, render = scene.instantiate, exact._render

    def counted_make(*arguments: Any, **options: Any) -> Any:
        made.append(options)
        return make(*arguments, **options)

    def counted_render(*arguments: Any) -> Any:
        rendered.append(arguments)
        return render(*arguments)

    monkeypatch.setattr(scene, "instantiate", counted_make)
    monkeypatch.setattr(exact, "_render", counted_render)
    loaded = scene_of(*lights)
    for times in (1, 2):
        loaded.render(samples=4)
        assert (len(made), len(rendered)) == (count, times * count)


def test_a_gradient_is_only_followed_where_it_is_asked_for(
    scene_of: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    def forbidden(*arguments: Any) -> Any:
        raise AssertionError("shadow edges were followed")

    monkeypatch.setattr(exact, "edge_gradient", forbidden)
    heights = torch.tensor(hills(), requires_grad=True)
    scene_of(sun(35)).render(heights, samples=4, shadow_edges=False).sum().backward()
    assert heights.grad is not None
    assert float(heights.grad.abs().max()) > 0


OBLIQUE = '<scale x="5" y="5"/><lookat origin="0, -10, 20" target="0, 0, 0" up="0, 1, 0"/>'
TURNED = '<scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="1, 0, 0"/>'
UNSCALED = '<lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'
WIDER = '<scale x="6" y="6"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'
ASIDE = '<scale x="5" y="5"/><lookat origin="1, 0, 20" target="1, 0, 0" up="0, 1, 0"/>'


@pytest.mark.parametrize(
    ("light", "written", "field"),
    [
        (sun(35), {"camera": OBLIQUE}, "sensor"),
        (sun(35), {"camera": TURNED}, "sensor"),
        (sun(35), {"camera": WIDER}, "sensor"),
        (sun(35), {"camera": ASIDE}, "sensor"),
        (sun(35), {"cols": 2 * SIDE}, "sensor"),
        (sun(35), {"kind": "perspective", "camera": UNSCALED}, "sensor"),
        (POINT, {}, "point"),
        (sun(35), {"max_depth": 3}, "max_depth"),
        (sun(35), {"max_depth": -1}, "max_depth"),
    ],
    ids=[
        "oblique",
        "turned",
        "wider",
        "aside",
        "oblong",
        "perspective",
        "point",
        "two bounces",
        "any bounces",
    ],
)
def test_gradients_that_would_be_wrong_are_refused_in_one_line_and_pictures_are_not(
    scene_of: Callable[..., Scene], tmp_path: Path, light: str, written: dict[str, Any], field: str
) -> None:
    loaded = scene_of(light, **written)
    heights = torch.tensor(loaded.heights, requires_grad=True)
    for refused in (loaded.top_view, lambda: loaded.render(heights)):
        with pytest.raises(
            InputError, match=rf"^{re.escape(str(tmp_path / 'scene.xml'))}: .*{field}"
        ) as error:
            refused()
        assert "\n" not in str(error.value)
    pictures = loaded.render(samples=4)
    assert pictures.shape == (1, SIDE, written.get("cols", SIDE))
    assert float(pictures.max()) > 0


def test_another_resolution_shows_the_same_plate(scene_of: Callable[..., Scene]) -> None:
    loaded = scene_of(sun(35), sky())
    fine = loaded.render(resolution=2 * SIDE, samples=256).numpy()
    assert fine.shape == (1, 2 * SIDE, 2 * SIDE)
    coarse = loaded.render(samples=1024).numpy()
    binned = fine.reshape(1, SIDE, 2, SIDE, 2).mean((2, 4))
    assert np.abs(binned - coarse).mean() < 0.01 * coarse.mean()
    assert loaded.render().shape == (1, SIDE, SIDE)
    assert loaded.top_view(resolution=20).evaluate(loaded.heights).pictures.shape == (1, 20, 20)


@pytest.mark.parametrize(
    ("heights", "message"),
    [
        (np.zeros((SIDE, SIDE + 1)), r"^heights: shape \(32, 33\)"),
        (np.zeros(SIDE), r"^heights: shape \(32,\)"),
        (np.full((SIDE, SIDE), np.nan), "^heights: not every value is finite"),
        (np.full((SIDE, SIDE), np.inf), "^heights: not every value is finite"),
    ],
)
def test_impossible_heights_are_refused(scene_of: Callable[..., Scene], heights: Array, message: str) -> None:
    with pytest.raises(InputError, match=message):
        scene_of(sun(35)).render(heights)


def test_heights_in_whole_millimetres_are_heights_too(scene_of: Callable[..., Scene]) -> None:
    loaded = scene_of(sun(35))
    whole = np.rint(2.0 * hills())
    assert torch.equal(loaded.render(whole.astype(np.int64)), loaded.render(whole))


def test_several_reliefs_at_once_are_each_as_alone(scene_of: Callable[..., Scene]) -> None:
    loaded = scene_of(sun(35), sky())
    reliefs = np.stack((hills(seed=1), hills(seed=2)))
    pictures = loaded.render(reliefs)
    assert pictures.shape == (2, 1, SIDE, SIDE)
    for relief, picture in zip(reliefs, pictures, strict=True):
        assert torch.equal(loaded.render(relief), picture)


def test_a_grey_scene_in_colour_has_the_same_pictures(scene_of: Callable[..., Scene]) -> None:
    grey = scene_of(sun(35), material=PLASTIC)
    in_colour = scene_of(sun(35), material=PLASTIC, variant="llvm_ad_rgb")
    assert (grey.variant, in_colour.variant) == ("llvm_ad_mono", "llvm_ad_rgb")
    seeds = range(12)
    ours, theirs = ([s.render(seed=seed).numpy()[0] for seed in seeds] for s in (grey, in_colour))
    assert z_squared(ours, theirs) < 1.2 * 11 / 9


def test_scenes_in_different_variants_do_not_disturb_each_other(scene_of: Callable[..., Scene]) -> None:
    def gradient(loaded: Scene, before_backward: Callable[[], Any]) -> Array:
        heights = torch.tensor(hills(), requires_grad=True)
        loss = loaded.render(heights, samples=4).sum()
        before_backward()
        loss.backward()
        assert heights.grad is not None
        return heights.grad.numpy()

    grey = scene_of(sun(35))
    picture, view = grey.render(), grey.top_view()
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
    ours = [loaded.top_view(seed=seed).evaluate(loaded.heights, False).pictures[0] for seed in seeds]
    assert z_squared(ours, [loaded.render(seed=seed).numpy()[0] for seed in seeds]) < 1.2 * 11 / 9


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
for wanted in (scene.top_view, lambda: scene.render(torch.zeros(scene.heights.shape, requires_grad=True))):
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


def test_a_texture_takes_the_place_of_the_scenes_own(mi: ModuleType, tmp_path: Path) -> None:
    path = write_scene(tmp_path, hills(), [sun(35)])
    other = np.full((2 * SIDE, 2 * SIDE), 0.25)
    np.save(tmp_path / "other.npy", other)
    loaded = load_scene(path, texture=tmp_path / "other.npy")
    np.testing.assert_array_equal(loaded.heights, other)
    assert float(loaded.render().std()) < 1e-5
    half = load_scene(path, texture=tmp_path / "other.npy", relief_mm=0.5)
    np.testing.assert_array_equal(half.heights, 0.5 * other)


def test_a_plate_of_another_size_is_refused(mi: ModuleType, tmp_path: Path) -> None:
    path = write_scene(tmp_path, hills(), [sun(35)])
    with pytest.raises(InputError, match=r"scene\.xml: heightfield: size_mm: .*10\.0 mm.*12\.0 mm"):
        load_scene(path, size_mm=12.0)
    assert load_scene(path, size_mm=SIZE_MM).size_mm == SIZE_MM


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads the process's memory from /proc")
def test_memory_does_not_grow_with_the_number_of_pictures(scene_of: Callable[..., Scene]) -> None:
    loaded = scene_of(sun(35), sky())

    def once(seed: int) -> None:
        heights = torch.tensor((0.5 + 0.01 * seed) * hills(), requires_grad=True)
        loaded.render(heights, seed=seed).sum().backward()

    def megabytes() -> float:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 2**20

    for seed in range(5):
        once(seed)
    before = megabytes()
    for seed in range(5, 35):
        once(seed)
    assert megabytes() - before < 30.0
