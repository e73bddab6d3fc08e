"""The viewer's part of a page: arrays that come back as they were, sound bodies, nobody's text obeyed."""

import base64
import hashlib
import io
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from markupsafe import Markup
from numpy.typing import NDArray
from PIL import Image

from relief.solids.body import Body
from retouch.pages.rendering import render_page
from retouch.pages.templates import asset
from retouch.pages.viewer import lighter
from retouch.pages.viewer.figure import key, viewer_figure
from retouch.pages.viewer.models import ColourLayer, ViewerModel
from retouch.pages.viewer.packing import STEPS, packed, packed_places
from tests.retouch.pages.outline import Outline

HOSTILE = '</script><script>alert("x")</script><img src=x onerror=alert(1)> & "quoted"'
SOURCES = Path(lighter.__file__).parent


def unpacked(entry: dict[str, Any]) -> NDArray[Any]:
    """What `source/meshes.js` makes of an entry."""
    kind = np.dtype(entry["kind"])
    planes = np.frombuffer(zlib.decompress(base64.b64decode(entry["data"])), np.uint8)
    values = planes.reshape(kind.itemsize, -1).T.copy().view(kind).reshape(-1, entry["columns"])
    return np.cumsum(values, axis=0, dtype=kind)


def ball(name: str = "ball", radius: float = 5.0, layers: tuple[str, ...] = ()) -> ViewerModel:
    mesh = trimesh.creation.icosphere(3, radius)
    body = Body(np.array(mesh.vertices), np.array(mesh.faces))
    colours = np.broadcast_to([0.2, 0.4, 0.6], body.vertices.shape)
    return ViewerModel(name, body, [ColourLayer(layer, colours, key(("#336699", layer))) for layer in layers])


def meshes_of(figure: Markup) -> list[dict[str, Any]]:
    (text,) = re.findall(r'<script type="application/json">(.*?)</script>', figure, re.DOTALL)
    return list(json.loads(text))


def page(figure: Markup, title: str = "ball") -> str:
    return render_page(
        "object.html.j2", viewer=True, kind=title, pair={"title": title}, figure=figure
    ).decode()


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32])
def test_arrays_come_back(kind: type) -> None:
    random = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (100, 3), endpoint=True)
    values: NDArray[Any] = random.astype(kind)
    np.testing.assert_array_equal(unpacked(packed(values)), values)


def test_places_come_back_to_half_a_step() -> None:
    vertices = np.random.default_rng(0).uniform(-40.0, 60.0, (500, 3))
    entry = packed_places(vertices)
    places = np.array(entry["low"]) + entry["step"] * unpacked(entry["positions"])
    assert np.abs(places - vertices).max() <= 0.51 * entry["step"] < 100.0 / STEPS


def test_a_figure_holds_its_models() -> None:
    before, layers = ball("before", layers=("Texture", "Seams")), ("Texture", "Seams")
    after = ViewerModel("after", Body(1.1 * before.body.vertices, before.body.faces), before.layers)
    figure = viewer_figure("a ball", before, after)
    first, second = meshes_of(figure)
    np.testing.assert_array_equal(unpacked(first["faces"]), before.body.faces)
    assert second["faces"] is None and [mesh["name"] for mesh in (first, second)] == ["before", "after"]
    assert tuple(layer["name"] for layer in first["layers"]) == layers
    assert (unpacked(second["layers"][0]["colours"]) == [51, 102, 153]).all()
    assert re.findall(r'data-layer="(\w+)"', figure) == ["Plain", *layers]
    assert re.findall(r'data-split="(\w+)"', figure) == ["100", "50", "0"]


@pytest.mark.slow
def test_the_still_picture_shows_the_layer_that_is_shown_first() -> None:
    for start, blue in (("Feel", True), ("Plain", False)):
        figure = viewer_figure("a ball", ball(layers=("Feel",)), start=start)
        (data,) = re.findall(r'src="data:image/png;base64,([^"]+)"', figure)
        with Image.open(io.BytesIO(base64.b64decode(data))) as image:
            pixels = np.asarray(image.convert("RGBA"), dtype=float)
        seen = pixels[pixels[..., 3] > 250.0]
        # A disc in a square, lit from the upper left.
        assert len(seen) / pixels[..., 3].size == pytest.approx(np.pi / 4 / 1.08, abs=0.03)
        assert (seen[:, 2] > 1.5 * seen[:, 0]).all() == blue
        rows, cols = pixels.shape[:2]
        assert pixels[rows // 4, cols // 4, 1] > 1.2 * pixels[3 * rows // 4, 3 * cols // 4, 1]


def test_layers_have_a_colour_for_each_vertex() -> None:
    with pytest.raises(ValueError, match="layer 'Feel'"):
        ViewerModel("ball", ball().body, [ColourLayer("Feel", np.zeros((3, 3)))])


def test_large_models_become_lighter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lighter, "MOST_FACES", 5000)
    mesh = trimesh.creation.icosphere(5, 10.0)
    body = Body(np.array(mesh.vertices), np.array(mesh.faces))
    left = np.where(body.vertices[:, :1] < 0.0, 1.0, 0.0) * np.ones(3)
    light = lighter.lighter(ViewerModel("ball", body, [ColourLayer("Side", left)]))
    assert 2000 < len(light.body.faces) < 6000
    assert light.body.areas.sum() == pytest.approx(body.areas.sum(), rel=0.03)
    np.testing.assert_allclose(np.linalg.norm(light.body.vertices, axis=1), 10.0, atol=0.05)
    far = np.abs(light.body.vertices[:, 0]) > 1.0
    assert ((light.layers[0].colours[far, 0] > 0.5) == (light.body.vertices[far, 0] < 0.0)).all()
    assert lighter.lighter(light) is light


def test_no_name_is_obeyed() -> None:
    model = ball(HOSTILE, layers=(HOSTILE,))
    text = page(viewer_figure(HOSTILE, model, ball("after")), HOSTILE)
    outline = Outline(text)
    assert outline.open == []
    assert not re.search(r"<img src=x|<script>alert", text)
    assert [mesh["name"] for mesh in meshes_of(Markup(text))] == [HOSTILE, "after"]


def test_the_page_asks_nothing_of_a_network_and_one_script_may_run() -> None:
    text = page(viewer_figure("a ball", ball()))
    assert not re.search(r"https?://", text)
    assert not re.search(r"url\(|@import|<link|<iframe|<object", text)
    assert all(link.startswith("data:image/png;base64,") for link in Outline(text).fetched)
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    assert f"script-src 'sha256-{digest}'" in text
    assert not re.search(
        r"\beval\(|new Function\(|fetch\(|XMLHttpRequest\b.{0,9}\.open", asset("viewer/viewer.js")
    )


def test_the_script_is_built_of_its_sources() -> None:
    """After a change of these, `make viewer` builds it anew."""
    digest = hashlib.sha256()
    for path in [
        SOURCES / "build.mjs",
        SOURCES / "package-lock.json",
        *sorted((SOURCES / "source").iterdir()),
    ]:
        digest.update(path.read_bytes())
    assert digest.hexdigest() in asset("viewer/viewer.js")[:200]
    assert "MIT" in (SOURCES / "LICENSE-three.txt").read_text(encoding="utf-8")
