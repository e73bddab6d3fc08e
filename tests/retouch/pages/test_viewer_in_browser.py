"""The viewer in a real browser: it draws, asks for nothing, obeys mouse and keys, and has a still picture."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.docs.pages import LAYOUT
from benchmarks.shared.browser import Browser, chromium
from relief.solids.body import Body
from retouch.pages.rendering import render_page
from retouch.pages.viewer.figure import viewer_figure
from retouch.pages.viewer.models import ColourLayer, ViewerModel
from tests.retouch.pages.test_viewer import ball

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium here"),
]
READY = """(async () => {
  const figure = document.querySelector("figure.viewer");
  while (!figure.dataset.state) await new Promise((done) => setTimeout(done, 20));
  await new Promise((done) => setTimeout(done, 300));
  return figure.dataset.state;
})()"""
FIGURE = "document.querySelector('figure.viewer')"


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of a white ball before, and a red one, a little larger, after."""
    body = ball().body
    models = [
        ViewerModel(
            name, Body(scale * body.vertices, body.faces), [ColourLayer("Feel", np.ones((642, 3)) * colour)]
        )
        for name, scale, colour in (("before", 1.0, [1, 1, 1]), ("after", 1.05, [1, 0, 0]))
    ]
    figure = viewer_figure("two balls", *models, start="Feel")
    path = tmp_path_factory.mktemp("pages") / "page.html"
    path.write_bytes(
        render_page("object.html.j2", viewer=True, kind="preview", pair={"title": "a ball"}, figure=figure)
    )
    return path


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser(webgl=True) as open_browser:
        yield open_browser


def opened(browser: Browser, file: Path, width: int = 1280) -> None:
    browser.open(file, width)
    assert browser.evaluate(READY) == "live"


def pixels(browser: Browser, path: Path) -> np.ndarray:
    """(rows, cols, 3) what the stage shows."""
    box = browser.evaluate(
        "(() => { const b = document.querySelector('.stage').getBoundingClientRect();"
        "return [b.x + scrollX, b.y + scrollY, b.width, b.height]; })()"
    )
    browser.picture(path, tuple(box))
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), dtype=float)


DRAWN = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
"""Script: waits until the next frame is drawn, which on a busy machine may take long."""


def pressed(browser: Browser, key: str, shift: bool = False) -> list[float]:
    """Azimuth, elevation, zoom, and the lamp's azimuth and elevation after a key."""
    event = f"new KeyboardEvent('keydown', {{ key: '{key}', shiftKey: {str(shift).lower()}, bubbles: true }})"
    browser.evaluate(f"document.querySelector('.stage').dispatchEvent({event})")
    browser.evaluate(DRAWN)
    data = browser.evaluate(f"{FIGURE}.dataset.camera + ' ' + {FIGURE}.dataset.lampAt")
    return [float(value) for value in data.split()]


@pytest.mark.parametrize("width", [390, 1280])
def test_it_draws_and_asks_for_nothing(width: int, browser: Browser, file: Path, tmp_path: Path) -> None:
    seen = browser.open(file, width)
    assert browser.evaluate(READY) == "live"
    assert seen.asked == [] and seen.complaints == [] and browser.complaints() == []
    assert browser.evaluate(LAYOUT) == []
    shown = pixels(browser, tmp_path / "shown.png")
    rows, cols = shown.shape[:2]
    left, right = shown[rows // 2, cols // 2 - cols // 8], shown[rows // 2, cols // 2 + cols // 8]
    assert np.ptp(left) < 25.0 < 100.0 < right[0] - right[1:].max()


def test_the_scale_bar_is_as_long_as_it_says(browser: Browser, file: Path, tmp_path: Path) -> None:
    opened(browser, file)
    length, unit = browser.evaluate("document.querySelector('.scale-bar').textContent").split()
    width = browser.evaluate("document.querySelector('.scale-bar').offsetWidth")
    browser.evaluate("document.querySelector('[data-split=\"0\"]').click()")
    browser.evaluate(DRAWN)
    shown = pixels(browser, tmp_path / "shown.png")
    red = (shown[..., 0] - shown[..., 1] > 60.0).any(axis=0)
    assert unit == "mm"
    assert np.count_nonzero(red) == pytest.approx(10.5 / float(length) * width, rel=0.03)


def test_keys_turn_the_camera_and_move_the_lamp(browser: Browser, file: Path) -> None:
    opened(browser, file)
    first = pressed(browser, "0")
    turned = pressed(browser, "ArrowRight")
    assert turned[0] != first[0] and turned[3:] == first[3:]
    lit = pressed(browser, "ArrowUp", shift=True)
    assert lit[:3] == turned[:3] and lit[3:] != turned[3:]
    assert pressed(browser, "+")[2] > 1.0
    assert pressed(browser, "0") == first
    pressed(browser, "b")
    assert (
        browser.evaluate("document.querySelector('[aria-pressed=true][data-split]').dataset.split") == "100"
    )


def test_the_mouse_turns_and_the_switch_gives_it_the_lamp(browser: Browser, file: Path) -> None:
    opened(browser, file)
    drag = """(async () => {
      const stage = document.querySelector(".stage"), box = stage.getBoundingClientRect();
      const send = (kind, x) => stage.dispatchEvent(new PointerEvent(kind, { pointerId: 1, bubbles: true,
        clientX: box.x + 40 + x, clientY: box.y + 40 }));
      stage.setPointerCapture = () => {};
      send("pointerdown", 0); send("pointermove", 60); send("pointerup", 60);
      await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
      const { camera, lampAt } = document.querySelector("figure.viewer").dataset;
      return [camera, lampAt];
    })()"""
    first = pressed(browser, "0")
    camera, lamp = browser.evaluate(drag)
    assert float(camera.split()[0]) != first[0] and float(lamp.split()[0]) == first[3]
    browser.evaluate("document.querySelector('.lamp').click()")
    moved_camera, moved_lamp = browser.evaluate(drag)
    assert moved_camera == camera and moved_lamp != lamp


def test_without_webgl_a_still_picture_stands_there(file: Path) -> None:
    with Browser() as plain:
        seen = plain.open(file, 1280)
        assert plain.evaluate(READY) == "still"
        assert seen.complaints == [] and plain.complaints() == []
        assert "still picture" in plain.evaluate("document.querySelector('.still-note').innerText")
        assert plain.evaluate("document.querySelector('.still').offsetWidth") > 200
        assert plain.evaluate("document.querySelector('.switches').offsetHeight") == 0
        assert plain.evaluate(LAYOUT) == []
