"""A tilt that changes what is felt is reported, and the slope that a natural texture has is none."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import mitsuba_scenes
from optimize.settings.skins import load_skin
from relief.corrections import levelled
from relief.relief import Relief
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from tactile.tilt import PLANE, warn_of_tilt

TEXTURES = sorted((Path(mitsuba_scenes.__file__).parent / "textures").glob("*.png"))
SKIN = load_skin("paper")


def roughness(relief: Relief) -> float:
    return measure_touch(relief, SKIN, "quick", quantities=(ROUGHNESS,)).means[ROUGHNESS.name]


def tilted(relief: Relief, across_mm: float, along_mm: float = 0.0) -> Relief:
    """A relief with this rise over its width and its height, without a plane of its own."""
    y, x = (np.linspace(0.0, 1.0, side) for side in relief.heights.shape)
    return replace(relief, heights=levelled(relief.heights) + across_mm * x + along_mm * y[:, None])


@pytest.mark.parametrize("size_mm", [10.0, 25.0])
@pytest.mark.parametrize("texture", TEXTURES, ids=lambda path: path.stem)
def test_no_natural_texture_is_tilted(
    texture: Path, size_mm: float, caplog: pytest.LogCaptureFixture
) -> None:
    relief = Relief.read(texture, size_mm=size_mm, repeats=False)
    caplog.clear()
    warn_of_tilt(relief, SKIN, roughness(relief))
    assert caplog.messages == []


@pytest.mark.parametrize("size_mm", [10.0, 25.0])
@pytest.mark.parametrize("name", ["bark", "gravel", "leather", "terrain"])
def test_a_low_relief_that_is_tilted_is_reported(
    name: str, size_mm: float, caplog: pytest.LogCaptureFixture
) -> None:
    """As far as the finger feels the tilt: 0.04 mm of relief with 0.3 mm of tilt over 10 mm."""
    relief = Relief.read(next(path for path in TEXTURES if path.stem == name), size_mm=size_mm, repeats=False)
    low = replace(relief, heights=relief.heights * (0.04 / np.ptp(relief.heights)))
    rise = 0.03 * size_mm
    for one in (tilted(low, rise), tilted(low, 0.0, -rise), tilted(low, 0.7 * rise, 0.7 * rise)):
        lifted = replace(one, heights=one.heights - one.heights.min())
        caplog.clear()
        warn_of_tilt(lifted, SKIN, roughness(lifted))
        assert len(caplog.messages) == 1 and "is tilted by 1.7°" in caplog.text and "--level" in caplog.text
    level = replace(low, heights=levelled(lifted.heights))
    caplog.clear()
    warn_of_tilt(level, SKIN, roughness(level))
    assert caplog.messages == []


def test_a_bare_plane_is_reported_and_a_tile_is_not(caplog: pytest.LogCaptureFixture) -> None:
    ramp = Relief(np.tile(np.linspace(0.0, 0.3, 64), (64, 1)), 10.0)
    warn_of_tilt(ramp, SKIN, roughness(ramp))
    assert "0.3 mm over the width, 0 mm over the height" in caplog.text
    caplog.clear()
    warn_of_tilt(replace(ramp, repeats=(True, True)), SKIN, roughness(ramp))
    assert caplog.messages == []


@pytest.mark.parametrize("finger", ["exploring", "firm", "layered", "measured", "paper"])
def test_the_bound_of_a_plane_holds(finger: str) -> None:
    skin = load_skin(finger)
    for rise in (0.03, 0.1, 1.0):
        ramp = Relief(np.tile(np.linspace(0.0, rise, 32), (32, 1)), 10.0)
        touch = measure_touch(ramp, skin, "quick", quantities=(ROUGHNESS,))
        share = (skin.patch_mm or 10.0) / 10.0
        assert touch.means[ROUGHNESS.name] <= PLANE * rise * share / skin.thickness_mm
