"""Plates of any sides and size: pictures, gradients, films, and bundled scenes that fit the plate."""

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from relief.relief import Relief
from tests.visual.differences import differ_by_noise
from tests.visual.scenes import PLASTIC, SIDE, SIZE_MM, Array, hills, sky, sun
from visual.explain import explain_scene
from visual.scene import Scene, load_scene
from visual.scene_file.plate_fitting import film_of

WIDE, TALL = hills()[:24], hills()[:, :24]
"""24 x 32 and 32 x 24 samples."""


def scene_with_a_pixel_a_sample(
    scene_of: Callable[..., Scene], *lights: str, heights: Array, **more: Any
) -> Scene:
    rows, cols = heights.shape
    return scene_of(*lights, heights=heights, rows=rows, cols=cols, **more)


@pytest.mark.slow
@pytest.mark.parametrize("heights", [WIDE, TALL], ids=["wide", "tall"])
def test_pictures_of_oblong_plates_are_mitsubas_within_noise(
    scene_of: Callable[..., Scene], heights: Array
) -> None:
    scene, seeds = (
        scene_with_a_pixel_a_sample(scene_of, sun(30), heights=heights, material=PLASTIC),
        range(12),
    )
    assert scene.light_scenes()[0].cameras[0].overhead
    ours = [scene.views(seed=s)[0].evaluate(heights, jacobian=False).pictures[0] for s in seeds]
    theirs = [scene.render(seed=s).numpy()[0] for s in seeds]
    assert ours[0].shape == heights.shape
    assert differ_by_noise(ours, theirs)
    assert np.abs(scene.render(model="fast").numpy()[0] - np.mean(theirs, axis=0)).mean() < 0.02 * np.mean(
        theirs
    )
    assert (scene.plate_weights() == 1.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("heights", [WIDE, TALL], ids=["wide", "tall"])
def test_the_jacobian_of_an_oblong_plate_is_that_of_mitsubas_pictures(
    scene_of: Callable[..., Scene], heights: Array
) -> None:
    scene = scene_with_a_pixel_a_sample(scene_of, sun(30), heights=heights)
    down, across = (np.arange(n) / n for n in heights.shape)
    direction = 0.02 * np.sin(2.0 * np.pi * (down[:, None] + 2.0 * across))
    up, low = (scene.render(heights + s * direction, samples=4096).numpy()[0] for s in (1, -1))
    ours, weights = (
        (view.evaluate(heights).jacobians[0] @ direction.ravel()).reshape(heights.shape)
        for view in (scene.views(seed=seed, strata=8)[0] for seed in (0, 1))
    )
    # Weighted by the change as other samples see it: numbers large beside their noise.
    assert (weights * ours).sum() == pytest.approx((weights * (up - low)).sum() / 2.0, rel=0.05)


@pytest.mark.slow
def test_a_square_film_shows_a_wide_plate_with_empty_rows_that_do_not_count(
    scene_of: Callable[..., Scene],
) -> None:
    scene = scene_of(sun(40), sky(), heights=WIDE)
    weights = scene.plate_weights()[0]
    assert (weights[:3] == 0.0).all() and (weights[-3:] == 0.0).all() and (weights[5:-5] > 0.0).all()
    np.testing.assert_allclose(
        scene.views()[0].evaluate(WIDE).pictures[0][5:-5].mean(),
        scene.render(samples=256).numpy()[0][5:-5].mean(),
        rtol=0.01,
    )


def test_a_camera_that_cuts_a_plate_off_is_told_once(
    scene_of: Callable[..., Scene], caplog: pytest.LogCaptureFixture
) -> None:
    scene = scene_of(sun(40), heights=TALL)
    with caplog.at_level(logging.WARNING):
        scene.plate_weights()
        scene.plate_weights()
    (told,) = (record.getMessage() for record in caplog.records)
    assert told.endswith(
        "scene.xml: sensor first: does not show the whole plate of 10 x 13.33 mm; the rest does not count"
    )


@pytest.fixture
def texture(tmp_path: Path) -> Path:
    """A wide relief of 25 mm."""
    save_heights_exr(tmp_path / "wide.exr", WIDE, 25.0)
    return tmp_path / "wide.exr"


def test_bundled_scenes_fit_the_texture(texture: Path, mi: object) -> None:
    scene = load_scene("studio", texture=texture)
    assert scene.surface.size_mm == (18.75, 25.0)
    assert scene.resolution == (96, 128)
    assert scene.light_scenes()[0].cameras[0].overhead
    (_, plate), (_, camera), *_ = explain_scene("studio", relief=Relief.read(texture))
    assert plate.startswith("25 x 18.75 mm")
    assert camera.startswith("straight above, the plate fills the picture, 128 x 96 pixels")


def test_what_the_user_defines_stays(texture: Path, mi: object) -> None:
    scene = load_scene("studio", {"resolution": "64"}, texture=texture)
    assert scene.resolution == (48, 64)
    with pytest.raises(InputError, match=r"the scene's plate is 20.0 mm, the texture's 25.0 mm"):
        load_scene("studio", {"size_mm": "20"}, texture=texture)


@pytest.mark.parametrize(
    ("samples", "pixels"), [(32, 128), (160, 160), pytest.param(1100, 1024, marks=pytest.mark.slow)]
)
def test_a_fine_texture_has_a_pixel_a_sample_up_to_1024(
    tmp_path: Path, mi: object, samples: int, pixels: int
) -> None:
    save_heights_exr(tmp_path / "fine.exr", np.zeros((samples, samples)), 12.5)
    assert load_scene("studio", texture=tmp_path / "fine.exr").resolution == (pixels, pixels)


@pytest.mark.parametrize(
    "name",
    [
        *("studio", "five_views", "evening", "one_sun", "other_lights", "other_materials"),
        *("in-hand", "in-hand-unseen", "in-hand-window"),
    ],
)
def test_a_larger_plate_fills_as_much_of_the_picture(tmp_path: Path, mi: object, name: str) -> None:
    shown = []
    for size_mm in (SIZE_MM, 40.0):
        path = tmp_path / f"{size_mm}.exr"
        save_heights_exr(path, (size_mm / 40.0) * hills(), size_mm)
        scene = load_scene(name, {"resolution": str(2 * SIDE)}, texture=path)
        shown.append((scene.plate_weights() > 0.0).mean(axis=(1, 2)))
        assert scene.size_mm == size_mm
    assert shown[1] == pytest.approx(shown[0], abs=0.01)


@pytest.mark.slow
def test_a_lamp_too_near_for_the_longer_side_is_a_near_one(
    scene_of: Callable[..., Scene],
) -> None:
    """At 450 mm: more than 40 times the 10 mm of the width, less than 40 times the 13.3 mm across it."""
    lamp = """<shape type="disk">
        <transform name="to_world"><rotate x="1" angle="180"/><translate z="450"/></transform>
        <emitter type="area"><rgb name="radiance" value="3"/></emitter>
    </shape>"""
    scene = scene_with_a_pixel_a_sample(scene_of, more=lamp, heights=TALL)
    assert scene.render(samples=4).numpy().shape == (1, 32, 24)
    (view,) = scene.views()
    (jacobian,) = view.evaluate(scene.heights).jacobians
    assert np.isfinite(jacobian.data).all() and abs(jacobian).sum() > 0.0


@pytest.mark.parametrize(
    ("fine", "coarse", "defines"),
    [((96, 192), (32, 64), {}), ((300, 200), (45, 30), {}), ((96, 192), (32, 64), {"resolution": "50"})],
)
def test_other_reliefs_have_the_film_of_the_finest(
    fine: tuple[int, int], coarse: tuple[int, int], defines: dict[str, str]
) -> None:
    film = film_of("studio", defines, fine, SIZE_MM)
    assert not film.keys() & defines.keys()
    scenes = [load_scene("studio", {**defines, **film}, relief=np.zeros(shape)) for shape in (fine, coarse)]
    alone = load_scene("studio", defines, relief=np.zeros(fine))
    assert scenes[0].resolution == scenes[1].resolution == alone.resolution
