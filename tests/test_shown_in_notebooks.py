"""What notebooks show of reliefs, results and verifications: a picture, and a table free of markup."""

import base64
import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import retouch
from relief.ground.formatting import html_table
from relief.heightmap import save_heights_exr
from relief.relief import Relief

HOSTILE = '<script>alert("x")</script>\x1b[2J\u202e.png'


def test_a_relief_is_a_picture_and_a_table() -> None:
    wave = 0.1 * np.sin(np.linspace(0.0, 20.0, 40))[None, :].repeat(30, axis=0)
    shown = Relief(wave, 10.0, name="wave")._repr_html_()
    found = re.search(r'src="data:image/png;base64,([^"]+)"', shown)
    assert found is not None
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(found[1]))))
    assert picture.std() > 5.0
    assert "<td>40 x 30</td>" in shown
    assert "<td>10.0 x 7.50 mm</td>" in shown


def test_names_are_no_markup() -> None:
    shown = Relief(np.zeros((16, 16)), 10.0, name=HOSTILE)._repr_html_()
    assert "<script" not in shown
    assert "\x1b" not in shown
    assert "\u202e" not in shown
    assert html_table({"a": None, "b": "1 < 2"}) == "<table><tr><td>b</td><td>1 &lt; 2</td></tr></table>"


@pytest.mark.slow
def test_a_result_shows_its_relief_and_its_verification(tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "noise.exr", np.random.default_rng(0).uniform(0.0, 0.3, (16, 16)))
    settings = retouch.run_from_scene(
        "studio",
        str(tmp_path / "noise.exr"),
        ["define.resolution=16", "touch.jnd=1", "descent.steps=2", "touch.model=quick"],
    )
    result = retouch.optimize(settings, tmp_path / "<b>run")
    shown = result._repr_html_()
    assert "<b>" not in shown
    assert "&lt;b&gt;run" in shown
    assert result.verification._repr_html_() in shown
    assert "change of the pictures" in shown
