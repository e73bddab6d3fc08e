"""Pictures in colour: their luminance is what `Scene.render` gives."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from retouch.commands.main import main
from tests.visual.scenes import SIDE, sky, sun
from visual.lights.parallel import LUMINANCE
from visual.scene import Scene

RED = "2.0 0.5 0.1"


@pytest.mark.parametrize("lights", [(sun(35, irradiance=RED), sky()), (sun(35), sky("0.1 0.2 0.9"))])
def test_the_luminance_of_colours_is_the_picture(
    scene_of: Callable[..., Scene], lights: tuple[str, ...]
) -> None:
    scene = scene_of(*lights, pixel_format="rgb")
    assert scene.colour and not scene_of(sun(35)).colour
    colours = scene.render_colour(samples=16)
    assert colours.shape == (3, 1, SIDE, SIDE)
    grey = np.tensordot(LUMINANCE, colours, 1)
    np.testing.assert_allclose(grey, scene.render(samples=16).numpy(), rtol=1e-5, atol=1e-7)
    assert np.abs(colours[0] / colours[2] - 1.0).max() > 0.2


def test_render_writes_colour_for_colour_scenes_and_grey_for_grey_ones(
    scene_of: Callable[..., Scene], tmp_path: Path
) -> None:
    for light, pixels, channels in (
        (sun(35, name="a", irradiance=RED), "rgb", 3),
        (sun(35, name="a"), "luminance", 1),
    ):
        scene_of(light, pixel_format=pixels)
        out = tmp_path / pixels
        assert main(["render", str(tmp_path / "scene.xml"), "-o", str(out), "--samples", "8"]) == 0
        read = OpenEXR.File(str(out / "a.exr")).channels()
        assert set(read) == ({"RGB"} if channels == 3 else {"Y"})
        shown = np.asarray(Image.open(out / "a.png"))
        assert shown.shape == ((SIDE, SIDE, 3) if channels == 3 else (SIDE, SIDE))
        if channels == 3:
            assert read["RGB"].pixels[..., 0].mean() > 3.0 * read["RGB"].pixels[..., 1].mean()
            assert shown[..., 0].mean() > shown[..., 2].mean()
