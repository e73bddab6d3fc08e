"""A scene told as a matte plate has the brightness of its own pictures."""

from collections.abc import Callable

import mitsuba as mi
import numpy as np
import pytest

from tests.visual.scenes import ALBEDO, IRRADIANCE, MATTE, PANEL, PLASTIC, RADIANCE, sky, sun
from visual.backend.user_settings import use
from visual.matte import matte_scene
from visual.scene import Scene

FLAT = np.zeros((32, 32))


def test_a_matte_plate_under_far_lamps_is_told_as_it_is(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(
        sun(35.0, 130.0, "left"), sun(60.0, 250.0, "low", 0.5 * IRRADIANCE), sky(), material=MATTE
    )
    told = matte_scene(scene)
    assert told.albedo == pytest.approx(ALBEDO, rel=1e-3)
    assert [(lamp.name, lamp.azimuth, lamp.elevation) for lamp in told.lamps] == [
        ("left", 130.0, 35.0),
        ("low", 250.0, 60.0),
    ]
    np.testing.assert_allclose([lamp.strength for lamp in told.lamps], [1.0, 0.5], rtol=1e-6)
    np.testing.assert_allclose([lamp.ambient * scene.white for lamp in told.lamps], RADIANCE, rtol=0.01)
    assert not (told.glossy or told.textured or told.simplified)


@pytest.mark.parametrize("material", [MATTE, PLASTIC])
def test_a_flat_plate_is_as_bright_as_in_the_pictures(material: str, scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35.0), sky(), heights=FLAT, material=material)
    told = matte_scene(scene)
    (lamp,) = told.lamps
    shown = told.albedo * (lamp.strength * np.sin(np.radians(lamp.elevation)) + lamp.ambient) * scene.white
    assert told.glossy == (material is PLASTIC)
    assert shown == pytest.approx(float(scene.render(samples=256).mean()), rel=0.02)


def test_a_lamp_that_is_near_or_wide_is_said_to_be_simplified(scene_of: Callable[..., Scene]) -> None:
    told = matte_scene(scene_of(PANEL))
    (lamp,) = told.lamps
    assert told.simplified and lamp.elevation == pytest.approx(90.0, abs=1.0) and lamp.ambient > 0.0


def test_ambient_light_alone_becomes_a_lamp_in_part(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sky())
    told = matte_scene(scene)
    (lamp,) = told.lamps
    level = lamp.strength * np.sin(np.radians(lamp.elevation)) + lamp.ambient
    assert told.simplified and level * scene.white == pytest.approx(RADIANCE, rel=0.01)


def test_the_variant_of_the_user_is_neither_taken_nor_changed(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(PANEL)
    before = matte_scene(scene)
    mine = str(mi.variant())
    use("scalar_rgb")
    try:
        assert matte_scene(scene) == before
        assert mi.variant() == "scalar_rgb"
    finally:
        use(mine)
