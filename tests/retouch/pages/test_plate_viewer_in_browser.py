"""Plates under a lamp that moves, in a real browser: as bright as the fast look, and asking for nothing."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from benchmarks.docs.pages import WIDTHS, faults
from benchmarks.shared.browser import Browser, chromium
from relief.ground.srgb import linear_rgb
from relief.relief import Relief
from retouch.pages.page import write_report
from retouch.pages.plate_viewer import SCRIPTS
from retouch.pages.templates import asset
from tests.retouch.pages.plausible import SIZE_MM, plausible, relief, with_sides
from tests.visual.scenes import ALBEDO, RADIANCE, sky, sun, write_scene
from visual.matte import Lamp, MatteScene
from visual.scene import Scene, load_scene
from visual.scene_looks import FastLook

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium here"),
]
SIDE = 64
LAMPS = ((10.0, 35.0), (130.0, 35.0), (250.0, 12.0), (0.0, 90.0))
TOLERANCE_PERCENT = 2.0
"""Largest mean absolute difference from the reference, % of the mean picture."""
LIVE = """(async () => {
  const figure = document.querySelector("figure.plate-figure");
  const over = () => figure.dataset.state === "live" || (figure.dataset.state === "still" && figure.hidden);
  while (!over()) await new Promise((done) => setTimeout(done, 20));
  await figure.plateView?.ready;
  window.view = figure.plateView;
  return figure.dataset.state;
})()"""
SMALL = f"""(() => {{
  const stage = document.querySelector(".plate-stage");
  Object.assign(stage.style, {{ width: "{SIDE}px", height: "{SIDE}px" }});
  return null;
}})()"""
STAGE = (160, 128)
"""Width and height, pixels, of a stage that is wider than the plate."""
BARE = """<!doctype html><style>{style}</style>
<div style="position: relative; width: {stage[0]}px; height: {stage[1]}px">
<div class="plate-view"></div></div>
<script>{script}
const view = new PlateView(document.querySelector(".plate-view"), {{ rows: {side}, cols: {side},
  size_mm: {size_mm}, heights: Float32Array.from({heights}), after: Float32Array.from({after}),
  albedo: [0.9, 0.5, 0.2], exposure: 1.3 }});
</script>"""
HANDS = """window.stage = document.querySelector(".plate-view");
stage.setPointerCapture = () => {};
window.drag = (x, y, more) => { const box = stage.getBoundingClientRect();
  const at = (kind, right, down) => stage.dispatchEvent(new PointerEvent(kind, { ...more,
    clientX: box.x + (0.5 + right) * box.width, clientY: box.y + (0.5 + down) * box.height,
    pointerId: 1, bubbles: true }));
  at("pointerdown", 0.3, 0.2); at("pointermove", x, y); at("pointerup", x, y); };
window.press = (key, shiftKey) =>
  stage.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey, bubbles: true }));
null"""
"""Scripts that drag, from right below the middle to a place in parts of the stage, and press keys."""
PIXELS = "(() => { const { width, height, data } = view.pixels(); return [width, height, [...data]]; })()"


@pytest.fixture(scope="module")
def reliefs() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Hills a millimetre apart, periodic, with deep shadows, and lower ones."""
    return relief(SIDE, 3, 1.0), 0.5 * relief(SIDE, 4, 1.0)


@pytest.fixture(scope="module")
def page_of(
    reliefs: tuple[NDArray[np.float64], NDArray[np.float64]], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[bool], Path]:
    """Writes a report of matte plates, of tiles or not, whose pictures show white as full white."""
    lamps = tuple(Lamp(f"lamp {k}", *angles, 1.0, RADIANCE) for k, angles in enumerate(LAMPS))
    matte = MatteScene(lamps, ALBEDO, glossy=False, textured=False, simplified=False)

    def page(repeats: bool) -> Path:
        whole = plausible(SIDE)
        sides = tuple(Relief(each, SIZE_MM, (repeats, repeats)) for each in reliefs)
        bright = np.ones_like(whole.before.pictures)
        report = with_sides(whole, relief=sides, pictures=(bright, bright))
        folder = tmp_path_factory.mktemp("report")
        return write_report(folder, replace(report, matte=matte, white=1.0, baseline=None))

    return page


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser(webgl=True) as open_browser:
        yield open_browser


@pytest.fixture
def plates(browser: Browser, page_of: Callable[[bool], Path]) -> Browser:
    """The report of plates that end, whose figure is alive."""
    browser.open(page_of(False), 1280)
    assert browser.evaluate(LIVE) == "live"
    return browser


def radiance(browser: Browser) -> NDArray[np.float64]:
    """(rows, cols) radiance over that of white, as the canvas shows it, a pixel at each sample."""
    browser.evaluate(SMALL)
    width, height, data = browser.evaluate(PIXELS)
    assert (width, height) == (SIDE, SIDE)
    return np.asarray(linear_rgb(np.reshape(data, (height, width, 4))[..., 0] / 255.0), dtype=np.float64)


def percent(shown: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    return 100.0 * float(np.abs(shown - reference).mean() / reference.mean())


@pytest.mark.parametrize("repeats", [False, True])
def test_it_is_as_bright_as_the_fast_look(
    repeats: bool,
    browser: Browser,
    page_of: Callable[[bool], Path],
    reliefs: tuple[NDArray[np.float64], NDArray[np.float64]],
    mi: ModuleType,
    tmp_path: Path,
) -> None:
    """The lamps by the fast look; the sky by Mitsuba, as the fast look has no net of it for matte plates."""
    suns = [sun(elevation, azimuth, irradiance=np.pi) for azimuth, elevation in LAMPS]
    original = Relief(reliefs[0], SIZE_MM, (repeats, repeats))

    def scene(*lights: str) -> Scene:
        return load_scene(write_scene(tmp_path, reliefs[0], lights, rows=SIDE, cols=SIDE), relief=original)

    lit = FastLook(scene(*suns)).renderer.pictures(torch.as_tensor(reliefs[0])).numpy()
    around = scene(sky()).render(samples=256).numpy()[0]
    browser.open(page_of(repeats), 1280)
    assert browser.evaluate(LIVE) == "live"
    browser.evaluate("view.setSwipe(100)")
    for (azimuth, elevation), reference in zip(LAMPS, lit, strict=True):
        for ambient, sky_part in ((0.0, 0.0), (RADIANCE, around)):
            browser.evaluate(
                f"view.setLamp({azimuth}, {elevation}); view.setMaterial({{ ambient: {ambient} }})"
            )
            assert percent(radiance(browser), reference + sky_part) < TOLERANCE_PERCENT


def test_it_asks_for_nothing_and_cuts_nothing_off(browser: Browser, page_of: Callable[[bool], Path]) -> None:
    page = page_of(False)
    assert [faults(browser, page, width) for width in WIDTHS[:2]] == [[], []]
    seen = browser.open(page, 1280)
    assert browser.evaluate(LIVE) == "live"
    assert seen.asked == [] and browser.complaints() == []


def test_the_edge_parts_the_plates(plates: Browser) -> None:
    shown = []
    for percent_of_width in (100, 50, 0):
        plates.evaluate(f"view.setSwipe({percent_of_width})")
        shown.append(radiance(plates))
    first, both, second = shown
    half = SIDE // 2
    assert np.abs(first - second).mean() > 0.02
    np.testing.assert_array_equal(both[:, :half], first[:, :half])
    np.testing.assert_array_equal(both[:, half:], second[:, half:])


def test_new_heights_take_the_place_of_the_old(plates: Browser) -> None:
    plates.evaluate("view.setSwipe(0)")
    wanted = radiance(plates)
    script = """(async () => {
      const { fine, rows, cols } = view.plates[1].field, own = (k) => 2 * Math.floor(k) + 1;
      const at = (k) => own(k / cols) * (2 * cols + 1) + own(k % cols);
      view.setHeights(Float32Array.from({ length: rows * cols }, (_, k) => fine[at(k)]));
      await view.ready;
      return view.plates.length;
    })()"""
    assert plates.evaluate(script) == 1
    np.testing.assert_array_equal(radiance(plates), wanted)


@pytest.mark.parametrize(
    "heights", ["new Float32Array(3)", "undefined", f"new Float32Array({SIDE**2}).fill(NaN)"]
)
def test_what_is_no_plate_is_refused(heights: str, plates: Browser) -> None:
    fault = f"(() => {{ try {{ view.setHeights({heights}); }} catch (fault) {{ return fault.message; }} }})()"
    assert plates.evaluate(fault).startswith("heights: ")
    assert plates.evaluate("view.plates.length") == 2


def test_the_lamp_follows_pointer_keys_sliders_and_buttons(plates: Browser) -> None:
    plates.evaluate(HANDS)
    lamp, tilt = "[view.lamp.azimuth, view.lamp.elevation]", "[view.tilt.right, view.tilt.down]"
    azimuth, elevation = plates.evaluate(f"drag(0, -0.25); {lamp}")
    assert azimuth == pytest.approx(90.0) and elevation == pytest.approx(60.0)
    right, down = plates.evaluate(f"drag(0.4, 0.2, {{ shiftKey: true }}); {tilt}")
    assert right > 0.0 and down == 0.0 and plates.evaluate(lamp) == [azimuth, elevation]
    assert plates.evaluate(f"press('ArrowRight'); {lamp}") == pytest.approx([85.0, 60.0])
    assert plates.evaluate(f"press('ArrowDown', true); {tilt}") == pytest.approx([right, 5.0])
    assert plates.evaluate("document.querySelector('.azimuth').value") == "85"
    plates.evaluate("""(() => {
      const slider = document.querySelector(".elevation");
      slider.value = 20;
      slider.dispatchEvent(new Event("input"));
    })()""")
    assert plates.evaluate(lamp) == [85, 20]
    plates.evaluate("document.querySelector('[data-lamp=\"1\"]').click()")
    assert plates.evaluate(lamp) == list(LAMPS[1])
    assert (
        plates.evaluate("document.querySelector('[data-lamp=\"1\"]').getAttribute('aria-pressed')") == "true"
    )
    assert plates.evaluate("press('b'); view.swipe") == 100
    assert plates.evaluate(
        f"document.querySelector('.reset').click(); [...{lamp}, ...{tilt}, view.swipe]"
    ) == [
        *LAMPS[0],
        *(0, 0, 50),
    ]


def test_a_tilted_plate_lies_within_the_stage_and_has_walls(plates: Browser) -> None:
    plates.evaluate("view.setSwipe(100); view.setTilt(-35, -40)")
    plates.evaluate(SMALL)
    width, height, data = plates.evaluate(PIXELS)
    covered = np.reshape(data, (height, width, 4))[..., 3] > 0
    assert not (covered[0].any() or covered[-1].any() or covered[:, 0].any() or covered[:, -1].any())
    assert 0.3 < covered.mean() < 0.8


@pytest.fixture(scope="module")
def bare(
    reliefs: tuple[NDArray[np.float64], NDArray[np.float64]], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A page of the component alone, in colours some of which are full, beside room on both sides."""
    heights, after = (np.round(each, 6).ravel().tolist() for each in reliefs)
    page = tmp_path_factory.mktemp("bare") / "page.html"
    script = "\n".join(asset(f"plate_viewer/{name}") for name in SCRIPTS)
    style = asset("plate_viewer/plate_viewer.css")
    parts = {"style": style, "script": script, "heights": heights, "after": after}
    page.write_text(BARE.format(**parts, stage=STAGE, side=SIDE, size_mm=SIZE_MM))
    return page


@pytest.fixture(scope="module")
def plain() -> Iterator[Browser]:
    with Browser() as open_browser:
        yield open_browser


@pytest.fixture
def canvas(plain: Browser, bare: Path) -> Browser:
    """The bare component in a browser without WebGL."""
    plain.open(bare, 1280)
    plain.evaluate("view.ready.then(() => null)")
    assert not plain.evaluate("Boolean(document.createElement('canvas').getContext('webgl2'))")
    return plain


def picture(browser: Browser) -> NDArray[np.float64]:
    """(rows, cols, 4) bytes of the whole canvas."""
    width, height, data = browser.evaluate(PIXELS)
    return np.reshape(np.asarray(data, dtype=np.float64), (height, width, 4))


def test_a_canvas_shows_what_the_graphics_card_shows(browser: Browser, canvas: Browser, bare: Path) -> None:
    browser.open(bare, 1280)
    browser.evaluate("view.ready.then(() => null)")
    assert browser.evaluate("view.tilts") and not canvas.evaluate("view.tilts")
    shown = []
    for azimuth, elevation in LAMPS:
        scripts = f"view.setLamp({azimuth}, {elevation}); view.setSwipe({40 + azimuth / 10})"
        both = []
        for one in (browser, canvas):
            one.evaluate(scripts)
            both.append(picture(one))
        assert both[0].shape == (STAGE[1], STAGE[0], 4)
        difference = np.abs(both[0] - both[1])
        assert difference.mean() < 0.02 and difference.max() <= 1.0
        shown.append(both[1])
    np.testing.assert_array_equal(shown[0][:, (0, 15, 144, 159)], 0.0)  # beside the plate
    assert np.abs(shown[0] - shown[1]).mean() > 5.0
    assert canvas.complaints() == []


def test_a_canvas_obeys_hands_and_does_not_tilt(canvas: Browser) -> None:
    canvas.evaluate(HANDS)
    canvas.evaluate("window.told = []; stage.addEventListener('plate-lamp', () => told.push(0)); null")
    lamp, tilt = "[view.lamp.azimuth, view.lamp.elevation]", "[view.tilt.right, view.tilt.down]"
    before = picture(canvas)
    assert canvas.evaluate(f"drag(0, -0.25); {lamp}") == pytest.approx([90.0, 60.0])
    assert np.abs(picture(canvas) - before).mean() > 5.0
    assert canvas.evaluate(f"drag(0, 0.25, {{ shiftKey: true }}); {lamp}") == pytest.approx([270.0, 60.0])
    assert canvas.evaluate(f"press('ArrowDown', true); {lamp}") == pytest.approx([270.0, 55.0])
    assert canvas.evaluate(f"view.setTilt(20, 10); view.setMode('tilt'); {tilt}") == [0, 0]
    canvas.evaluate("drag(0, -0.25); view.setMaterial({ exposure: 0 })")
    assert canvas.evaluate("told.length") == 7
    assert (picture(canvas)[:, 16:144] == (0, 0, 0, 255)).all()
    canvas.evaluate("view.setMaterial({ exposure: 1 }); press('b')")
    assert canvas.evaluate("view.swipe") == 100
    first = picture(canvas)
    canvas.evaluate("press('b')")
    second = picture(canvas)
    canvas.evaluate("view.setSwipe(50)")
    both, half = picture(canvas), STAGE[0] // 2
    assert np.abs(first - second).mean() > 2.0
    np.testing.assert_array_equal(both[:, :half], first[:, :half])
    np.testing.assert_array_equal(both[:, half:], second[:, half:])
    flat = f"view.setHeights(new Float32Array({SIDE**2})); view.ready.then(() => null)"
    canvas.evaluate(flat)
    assert np.ptp(picture(canvas)[:, 16:144], axis=(0, 1)).max() == 0.0
    assert canvas.complaints() == []


def test_a_canvas_takes_the_place_of_a_lost_graphics_card(browser: Browser, bare: Path) -> None:
    browser.open(bare, 1280)
    browser.evaluate("view.ready.then(() => null)")
    before = picture(browser)
    browser.evaluate("""new Promise((done) => {
      view.element.addEventListener("plate-lost", done, { once: true });
      view.setTilt(20, 10);
      view.screen.gl.getExtension("WEBGL_lose_context").loseContext();
    }).then(() => null)""")
    assert not browser.evaluate("view.tilts")
    assert np.abs(picture(browser) - before).mean() < 0.02
    assert browser.evaluate("document.querySelectorAll('canvas').length") == 1


def test_it_lets_go_of_the_graphics_card(plates: Browser) -> None:
    assert plates.evaluate(
        "(() => { const { gl } = view.screen; view.destroy(); return gl.isContextLost(); })()"
    )
    assert plates.evaluate("document.querySelector('.plate-view').childElementCount") == 0
    assert plates.complaints() == []


def test_without_webgl_the_pictures_remain(page_of: Callable[[bool], Path], plain: Browser) -> None:
    seen = plain.open(page_of(False), 1280)
    assert plain.evaluate(LIVE) == "still"
    assert seen.complaints == [] and plain.complaints() == []
    assert plain.evaluate("document.querySelector('.plate-figure').offsetHeight") == 0
    assert plain.evaluate("[...document.querySelectorAll('#eye .pair img')].every((i) => i.offsetWidth > 50)")
