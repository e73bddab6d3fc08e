"""A scene as conditions: what is rendered, what is not, and what is refused."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import torch

import visual
from relief.ground.errors import InputError
from relief.heightmap import save_heights_png
from relief.relief import Relief
from tests.visual.differences import differ_by_noise
from tests.visual.scenes import (
    ALBEDO,
    FLOOR,
    IRRADIANCE,
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
from visual import loading
from visual.exact import render as exact
from visual.explain import explain_scene
from visual.scene import Scene, load_scene
from visual.scene_file.check import check_scene, instantiate
from visual.scene_file.plate_fitting import scene_relief

LOW_POINT = '<emitter type="point"><point name="position" x="3" y="2" z="2"/></emitter>'


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


def test_a_scene_is_shown_in_one_line(scene_of: Callable[..., Scene]) -> None:
    assert repr(scene_of(sun(35, name="left"), sun(40), variant="llvm_ad_mono")) == (
        "<Scene scene.xml: 32 x 32 heights, 10 mm; 32 x 32 pixels; left, light-2; llvm_ad_mono>"
    )


def test_the_package_offers_its_public_names_and_loads_them_on_first_use() -> None:
    assert set(visual.__all__) <= set(dir(visual))
    assert (visual.Scene, visual.load_scene) == (Scene, load_scene)
    with pytest.raises(AttributeError):
        visual.look  # noqa: B018


def test_a_flat_plate_is_as_bright_as_its_lights_say(scene_of: Callable[..., Scene]) -> None:
    flat = np.full((SIDE, SIDE), 0.5)
    pictures = scene_of(sun(35), sun(90), sky(), heights=flat).render(samples=256).numpy()
    suns = np.sin(np.radians([35, 90])) * IRRADIANCE / np.pi
    np.testing.assert_allclose(pictures.mean((1, 2)), ALBEDO * (suns + RADIANCE), rtol=2e-3)


@pytest.mark.slow
def test_lights_rendered_alone_add_up_to_all_of_them_together(
    mi: ModuleType, scene_of: Callable[..., Scene], tmp_path: Path
) -> None:
    apart = scene_of(sun(35), sun(40, 200), material=PLASTIC)
    together = instantiate(check_scene(tmp_path / "scene.xml"))
    seeds = range(16)
    sums = [apart.render(seed=seed).sum(0).numpy() for seed in seeds]
    whole = [np.array(mi.render(together, spp=64, seed=seed))[..., 0] for seed in seeds]
    assert differ_by_noise(sums, whole)


@pytest.mark.slow
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
    make, render = loading.instantiate, exact._render

    def counted_make(*arguments: Any, **options: Any) -> Any:
        made.append(options)
        return make(*arguments, **options)

    def counted_render(*arguments: Any) -> Any:
        rendered.append(arguments)
        return render(*arguments)

    monkeypatch.setattr(loading, "instantiate", counted_make)
    monkeypatch.setattr(exact, "_render", counted_render)
    loaded = scene_of(*lights)
    for times in (1, 2):
        loaded.render(samples=4)
        assert (len(made), len(rendered)) == (1, times * count)


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


@pytest.mark.parametrize(
    ("light", "written", "field"),
    [
        (sun(35), {"camera": OBLIQUE, "more": FLOOR}, "shape"),
        (LOW_POINT, {}, "point"),
    ],
    ids=[
        "a table in view",
        "point",
    ],
)
def test_gradients_that_would_be_wrong_are_refused_in_one_line_and_pictures_are_not(
    scene_of: Callable[..., Scene], tmp_path: Path, light: str, written: dict[str, Any], field: str
) -> None:
    loaded = scene_of(light, **written)
    heights = torch.tensor(loaded.heights, requires_grad=True)
    for refused in (loaded.views, lambda: loaded.render(heights)):
        with pytest.raises(
            InputError, match=rf"^{re.escape(str(tmp_path / 'scene.xml'))}: .*{field}"
        ) as error:
            refused()
        assert "\n" not in str(error.value)
    pictures = loaded.render(samples=4)
    assert pictures.shape == (1, SIDE, written.get("cols", SIDE))
    assert float(pictures.max()) > 0


@pytest.mark.slow
def test_another_resolution_shows_the_same_plate(scene_of: Callable[..., Scene]) -> None:
    loaded = scene_of(sun(35), sky())
    fine = loaded.render(resolution=2 * SIDE, samples=256).numpy()
    assert fine.shape == (1, 2 * SIDE, 2 * SIDE)
    coarse = loaded.render(samples=1024).numpy()
    binned = fine.reshape(1, SIDE, 2, SIDE, 2).mean((2, 4))
    assert np.abs(binned - coarse).mean() < 0.01 * coarse.mean()
    assert loaded.render().shape == (1, SIDE, SIDE)
    assert loaded.views(resolution=20)[0].evaluate(loaded.heights).pictures.shape == (1, 20, 20)


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


def test_a_texture_takes_the_place_of_the_scenes_own(mi: ModuleType, tmp_path: Path) -> None:
    path = write_scene(tmp_path, hills(), [sun(35)])
    other = np.full((2 * SIDE, 2 * SIDE), 0.25)
    np.save(tmp_path / "other.npy", other)
    loaded = load_scene(path, texture=tmp_path / "other.npy")
    np.testing.assert_array_equal(loaded.heights, other)
    assert float(loaded.render().std()) < 1e-5
    half = load_scene(path, relief=Relief.read(tmp_path / "other.npy", height_scale=0.5))
    np.testing.assert_array_equal(half.heights, 0.5 * other)


def test_a_plate_of_another_size_is_refused(mi: ModuleType, tmp_path: Path) -> None:
    path = write_scene(tmp_path, hills(), [sun(35)])
    with pytest.raises(InputError, match=r"scene\.xml: heightfield: size_mm: .*10\.0 mm.*12\.0 mm"):
        load_scene(path, size_mm=12.0)
    assert load_scene(path, size_mm=SIZE_MM).size_mm == SIZE_MM


def test_the_header_of_a_height_map_goes_before_the_scene_and_after_the_argument(
    mi: ModuleType, tmp_path: Path
) -> None:
    path = write_scene(tmp_path, hills(), [sun(35)])
    texture, wide = tmp_path / "own.png", tmp_path / "wide.png"
    save_heights_png(texture, hills(), 1.5, SIZE_MM)
    save_heights_png(wide, hills(), 1.5, 20.0)
    text = path.read_text().replace('"heights.npy"/>', '"own.png"/><float name="relief_mm" value="2"/>')
    path.write_text(text)
    np.testing.assert_allclose(load_scene(path).heights, hills(), atol=2e-5)
    np.testing.assert_allclose(scene_relief(path, relief_mm=3.0).heights, 2.0 * hills(), atol=4e-5)
    with pytest.raises(InputError, match=r"scene\.xml: heightfield: size_mm: .*10\.0 mm.*20\.0 mm"):
        load_scene(path, texture=wide)
    with pytest.raises(InputError, match=r"size_mm: .*10\.0 mm.*20\.0 mm"):
        explain_scene(path, relief=Relief.read(wide))
    assert load_scene(path, texture=wide, size_mm=SIZE_MM).size_mm == SIZE_MM


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


# Pixels that show the plate

WIDE = '<scale x="10" y="10"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'
ASIDE = '<lookat origin="6, -14, 18" target="0, 0, 0" up="0, 0, 1"/>'
AWAY = '<lookat origin="6, -14, 18" target="6, -14, 30" up="0, 1, 0"/>'
CUBE = """<shape type="cube">
    <transform name="to_world"><scale x="2.5" y="5" z="1"/><translate x="-2.5" z="4"/></transform>
</shape>"""


def test_all_pixels_of_a_plate_that_fills_the_picture_count_alike(scene_of: Callable[..., Scene]) -> None:
    weights = scene_of(sun(35), sun(40, 200)).plate_weights()
    assert weights.shape == (2, SIDE, SIDE) and (weights == 1.0).all()
    assert (scene_of(sun(35), more=FLOOR).plate_weights() == 1.0).all()


def test_pixels_beside_the_plate_do_not_count(scene_of: Callable[..., Scene]) -> None:
    weights = scene_of(sun(35), sun(40, 200), camera=WIDE).plate_weights()
    expected = np.zeros((2, SIDE, SIDE))
    expected[:, 8:24, 8:24] = 4.0
    np.testing.assert_array_equal(weights, expected)


def test_pixels_in_which_another_shape_hides_the_plate_do_not_count(scene_of: Callable[..., Scene]) -> None:
    weights = scene_of(sun(35), more=CUBE).plate_weights()
    np.testing.assert_array_equal(weights, np.repeat([[[0.0, 2.0]]], SIDE // 2, axis=2).repeat(SIDE, axis=1))


def test_pixels_of_a_camera_from_the_side_count_where_the_plate_is_lit(
    scene_of: Callable[..., Scene],
) -> None:
    scene = scene_of(sun(60), camera=ASIDE, kind="perspective", heights=np.zeros((SIDE, SIDE)))
    for resolution in (None, 2 * SIDE):
        weights, picture = scene.plate_weights(resolution), scene.render(resolution=resolution).numpy()
        assert ((weights > 0.0) != (picture > 0.0)).mean() < 0.01
        assert weights.mean() == pytest.approx(1.0)


def test_pixels_for_a_millimetre_of_the_plate(scene_of: Callable[..., Scene]) -> None:
    """From above 32 pixels show 10 mm, or 20 mm; a slanted view is narrower in one direction only."""
    assert scene_of(sun(35), sun(40, 200)).pixels_per_mm() == pytest.approx([3.2, 3.2])
    assert scene_of(sun(35), camera=WIDE).pixels_per_mm() == pytest.approx([1.6])
    slanted = '<scale x="5" y="5"/><lookat origin="0, -20, 20" target="0, 0, 0" up="0, 0, 1"/>'
    assert scene_of(sun(35), camera=slanted).pixels_per_mm() == pytest.approx([3.2])
    # Mitsuba's default field of view is 50 mm of a film 36 x 24 mm, by its diagonal: 46.8 degrees.
    upright = '<lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'
    width_mm = 40.0 * np.tan(np.radians(46.8 / 2)) / np.sqrt(2)
    found = scene_of(sun(35), camera=upright, kind="perspective").pixels_per_mm()
    assert found == pytest.approx([SIDE / width_mm], rel=1e-3)


def test_a_camera_that_looks_away_from_the_plate_is_named(scene_of: Callable[..., Scene]) -> None:
    with pytest.raises(InputError, match="sensor first: does not show the plate"):
        scene_of(sun(60), camera=AWAY, kind="perspective").plate_weights()
