"""Figures whose lamp moves: heights that come back as they were, honest notes, and nobody's text obeyed."""

import base64
import json
import re
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from markupsafe import Markup
from numpy.typing import NDArray

from relief.relief import Relief
from relief.relief_shading import averaged
from retouch.pages.plate_viewer import SCRIPTS
from retouch.pages.plate_viewer.appearance import STUDIO, Appearance
from retouch.pages.plate_viewer.figure import MOST_SAMPLES, packed_plates, plate_figure, plate_spot
from retouch.pages.templates import asset
from tests.retouch.pages.outline import Outline
from visual.matte import Lamp, MatteScene

HOSTILE = '</script><script>alert("x")</script><img src=x onerror=alert(1)> & "quoted"'
MATTE = MatteScene((Lamp("sun", 70.0, 20.0, 1.0, 0.2),), 0.4, glossy=False, textured=False, simplified=False)


def rough(rows: int, cols: int, seed: int = 0) -> NDArray[np.float64]:
    """Heights, mm, of which neighbours know nothing: the worst to pack."""
    return np.random.default_rng(seed).uniform(0.0, 1.2, (rows, cols))


def unpacked(plates: dict[str, Any]) -> list[NDArray[np.float64]]:
    """What `plate_figures.js` makes of packed plates."""
    shape, fields = (plates["rows"], plates["cols"]), []
    for entry in plates["heights"]:
        planes = np.frombuffer(zlib.decompress(base64.b64decode(entry["data"])), np.uint8)
        steps = planes.reshape(2, -1).T.copy().view("<u2").reshape(shape)
        steps = np.cumsum(np.cumsum(steps, axis=0, dtype=np.uint16), axis=1, dtype=np.uint16)
        fields.append(entry["low"] + entry["step"] * steps)
    return fields


def data_of(html: Markup) -> dict[str, Any]:
    (text,) = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    return dict(json.loads(text))


def test_heights_come_back_to_half_a_step() -> None:
    pair = [Relief(rough(40, 64, seed) - 0.3, 10.0) for seed in (1, 2)]
    plates = packed_plates(pair)
    for relief, entry, shown in zip(pair, plates["heights"], unpacked(plates), strict=True):
        assert entry["step"] <= max(1.2 / 65535, relief.pitch_mm / 400)
        np.testing.assert_allclose(shown, relief.heights, atol=0.501 * entry["step"])


def test_a_flat_plate_comes_back_flat() -> None:
    (shown,) = unpacked(packed_plates([Relief(np.full((4, 4), 0.7), 10.0)]))
    np.testing.assert_array_equal(shown, 0.7)


def test_finer_heights_are_averaged_and_the_figure_says_so() -> None:
    heights = rough(300, 600)
    html = plate_figure("t", {"before": Relief(heights, 10.0)})
    data = data_of(html)
    assert (data["rows"], data["cols"]) == (128, MOST_SAMPLES)
    np.testing.assert_allclose(
        unpacked(data)[0], averaged(heights, MOST_SAMPLES), atol=data["heights"][0]["step"]
    )
    assert "256 × 128 samples, averaged from 600 × 300" in html


def test_two_plates_are_shown_in_the_samples_of_the_coarser() -> None:
    plates = packed_plates([Relief(rough(64, 64), 10.0), Relief(rough(32, 32), 10.0)])
    assert (plates["rows"], plates["cols"]) == (32, 32)


def test_plates_of_different_sizes_share_no_figure() -> None:
    with pytest.raises(ValueError, match="different sizes"):
        plate_figure("t", {"A": Relief(rough(8, 8), 10.0), "B": Relief(rough(8, 8), 16.0)})


def test_the_worst_figure_and_its_program_take_less_than_a_megabyte() -> None:
    plates = {name: Relief(rough(512, 512, seed), 10.0) for seed, name in enumerate("AB")}
    files = (*SCRIPTS, "plate_figures.js", "plate_viewer.css")
    program = sum(len(asset(f"plate_viewer/{name}")) for name in files)
    assert len(plate_figure("t", plates)) + program < 1e6


def test_words_stay_words() -> None:
    lamps = (replace(STUDIO.lamps[0], name=HOSTILE), STUDIO.lamps[1])
    hostile = replace(STUDIO, lamps=lamps, note=HOSTILE)
    relief = Relief(rough(8, 8), 10.0, name=HOSTILE)
    figure = plate_figure(HOSTILE, {HOSTILE: relief, "b": relief}, hostile)
    for html, fetched in ((figure, []), (plate_spot("data:,", HOSTILE, relief), ["data:,"])):
        outline = Outline(str(html))
        assert outline.tags.count("script") == 1 and outline.handlers == [] and outline.fetched == fetched
    assert data_of(figure)["lamps"][0]["name"] == HOSTILE
    assert HOSTILE in Outline(str(figure)).text


def test_the_plate_has_the_colour_and_brightness_of_the_pictures() -> None:
    grey = Appearance.of(MATTE, 1.5)
    assert grey.albedo == (0.4, 0.4, 0.4) and grey.options()["lamp"]["azimuth"] == 70.0
    red, green, blue = Appearance.of(MATTE, 1.5, np.full((1, 4, 4, 3), (0.4, 0.2, 0.1))).albedo
    assert red == pytest.approx(2.0 * green) and green == pytest.approx(2.0 * blue)
    assert np.dot((red, green, blue), (0.212671, 0.715160, 0.072169)) == pytest.approx(0.4)


def test_what_the_figure_leaves_out_is_said() -> None:
    assert Appearance.of(MATTE, 1.0).note == "The surface is shown matte."
    assert "without the gloss" in Appearance.of(replace(MATTE, glossy=True), 1.0).note
    assert "mean of its texture" in Appearance.of(replace(MATTE, textured=True), 1.0).note
    assert "comes evenly" in Appearance.of(replace(MATTE, simplified=True), 1.0).note
