"""The whole way in a real browser: from a picture that nobody has prepared to a file for a printer."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

pytest.importorskip("nicegui", reason="without the extra app")

from benchmarks.shared.app_window import COMMAND, FELT, SHOWN, App, Window
from benchmarks.shared.browser import chromium

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium here"),
]

QUICK = ("define.resolution=32", "verify.model=layer", "verify.samples=16", "verify.baseline=false")
"""Settings of runs that take seconds."""
DONE = "/-1: done/.test(document.querySelector('.state')?.innerText)"
NAMES = ("Picture", "Feel", "Run", "Compare", "Object", "Print")


@pytest.fixture(scope="module")
def app(tmp_path_factory: pytest.TempPathFactory) -> Iterator[App]:
    folder = tmp_path_factory.mktemp("app")
    (folder / "runs").mkdir()
    feel = {"jnd": 1.0, "settings": QUICK}
    kept = {"document": {"feel": feel}, "queue": []}
    (folder / "runs" / "app.json").write_text(json.dumps(kept))
    with App(folder) as app:
        yield app
        assert app.close() == 0


@pytest.fixture(scope="module")
def window() -> Iterator[Window]:
    with Window(webgl=True) as window:
        yield window


def pictures(folder: Path) -> list[Path]:
    """Three pictures of unlike kinds: a photograph in colour, a drawing with a palette, grey of 16 bits."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:120, 0:160] / 12.0
    waves = np.stack([np.sin(x + 0.3 * k) * np.cos(y - 0.2 * k) for k in range(3)], axis=-1)
    colours = np.clip(128 + 90 * waves + 12 * rng.standard_normal(waves.shape), 0, 255).astype(np.uint8)
    files = [folder / name for name in ("<b>photo.jpg", "drawing.gif", "grey.tif")]
    Image.fromarray(colours).save(files[0])
    Image.fromarray(colours).quantize(8).save(files[1])
    Image.fromarray((40000 + 20000 * waves[..., 0]).astype(np.uint16)).save(files[2])
    return files


def whole(window: Window) -> list[str]:
    """What is wrong with the page as a whole: console messages, other machines, parts cut off."""
    asked = [one for one in window.asked() if not re.match(r"(http|ws)://127\.0\.0\.1:\d+/|data:|blob:", one)]
    wider = window.evaluate("document.documentElement.scrollWidth > innerWidth")
    return [*window.faults(), *asked, *(["wider than the window"] if wider else [])]


def dropped(window: Window, file: Path) -> None:
    window.choose_file(".drop-zone input[type=file]", file)
    window.wait(f"{COMMAND}.includes('{file.stem.replace('<b>', 'b-')}')")
    window.wait("document.querySelector('.side').innerText.includes('160 × 120 pixels')")


def to(window: Window, stage: str) -> None:
    window.click_text("nav button", stage)
    window.wait(f"document.querySelector('nav [aria-current=page]').innerText == '{stage}'")


def test_the_whole_way_by_mouse(app: App, window: Window, tmp_path: Path) -> None:
    window.visit(app.address, 1280, 800)
    window.wait(SHOWN)
    assert "token" not in window.evaluate("location.href")
    for picture in reversed(pictures(tmp_path)):
        dropped(window, picture)
    assert window.evaluate("document.querySelectorAll('.side b').length") == 0  # a name is text
    window.wait("document.querySelector('.crop-box img')?.complete")
    left, top, *_ = window.place(".crop-box")
    window.drag([(left + 20, top + 20), (left + 60, top + 50), (left + 110, top + 110)])
    window.wait(f"{COMMAND}.includes('--crop=')")
    window.wait(FELT)
    roughness = window.evaluate("document.querySelector('.number .value').innerText")
    assert 0.0 < float(roughness) < 0.5

    to(window, "Feel")
    window.wait("document.querySelector('.jnd-slider input')")
    left, top, width, height = window.place(".jnd-slider input")
    for _ in range(2):
        window.drag([(left + width * (8.0 / 12.0), top + height / 2)])
    window.wait(f"!{COMMAND}.includes('--jnd=1 ')")
    wanted = float(window.evaluate(f"{COMMAND}.match(/--jnd=([0-9.]+)/)[1]"))
    assert 1.5 < wanted < 2.5

    to(window, "Run")
    window.click_text(".side button", "Run")
    window.wait("document.querySelector('.state')?.innerText.includes('-1: running')")
    window.visit(app.address, 1280, 800)  # loaded again while it runs
    to(window, "Run")
    window.wait(DONE)
    folder = app.folder / "runs" / "b-photo-1"
    result = json.loads((folder / "result.json").read_text())
    assert abs(result["touch"]["jnd_from_original"] - wanted) < 0.1

    window.click_text(".side button", "Compare")
    window.wait(SHOWN)
    for way in ("Side by side", "Blink", "Change", "Strain", "Swipe"):
        window.click_text(".ways button", way)
    window.wait(SHOWN)
    jnd = window.evaluate("document.querySelector('.side .value').innerText")
    assert np.isclose(float(jnd), result["touch"]["jnd_from_original"], atol=0.006)

    to(window, "Print")
    window.click_text("button", "Write the file")
    window.wait("document.querySelector('.side').innerText.includes('MiB')")
    assert (app.folder / "runs" / "b-photo-1-print.3mf").stat().st_size > 1000
    assert whole(window) == []


def test_the_whole_way_by_keys(app: App, window: Window) -> None:
    window.visit(app.address, 1920, 1080)
    window.wait(SHOWN)

    def tab_to(selector: str, most: int = 80) -> None:
        """Go on by the tabulator until an element has the focus, which is then to be seen."""
        for _ in range(most):
            window.key("Tab")
            if window.evaluate(f"document.activeElement.matches({json.dumps(selector)})"):
                style = "getComputedStyle(document.activeElement)"
                seen = window.evaluate(f"{style}.outlineStyle != 'none' || {style}.boxShadow != 'none'")
                assert seen or "range" in selector, selector
                return
        raise AssertionError(f"{selector}: not reached by the tabulator")

    def stage(name: str) -> None:
        window.evaluate("document.activeElement.blur()")
        tab_to(f"nav button:nth-child({1 + NAMES.index(name)})")
        window.key("Enter")
        window.wait(f"document.querySelector('nav [aria-current=page]').innerText == '{name}'")

    tab_to("button[title=dots]")
    window.key("Enter")
    window.wait(f"{COMMAND}.includes('prepare dots') && {FELT}")
    tab_to(".crop-square")
    for _ in range(3):
        window.key("ArrowLeft", shift=True)
    window.wait(f"{COMMAND}.includes('--crop=')")
    tab_to("input.range")
    before = window.evaluate(COMMAND)
    window.key("ArrowLeft")
    window.wait(f"{COMMAND} != {json.dumps(before)}")
    window.key("z", control=True)
    window.wait(FELT)

    stage("Feel")
    tab_to(".jnd-slider input")
    for _ in range(5):
        window.key("ArrowRight")
    window.wait(f"/--jnd=/.test({COMMAND})")
    stage("Run")
    tab_to("button.primary")
    window.key("Enter")
    window.wait("/dots-1: done/.test(document.querySelector('.state')?.innerText)")
    stage("Print")
    tab_to("button.primary")
    window.key("Enter")
    window.wait("document.querySelector('.side').innerText.includes('MiB')")
    assert (app.folder / "runs" / "dots-1-print.3mf").is_file()
    assert whole(window) == []


def test_a_feel_is_painted_in_grades_and_shown_at_every_place(window: Window, tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    quick = {"settings": [setting.replace("=32", "=48") for setting in QUICK]}
    (tmp_path / "runs" / "app.json").write_text(json.dumps({"document": {"feel": quick}, "queue": []}))
    with App(tmp_path, "gravel-tile") as app:
        window.visit(app.address, 1280, 800)
        window.wait(f"{SHOWN} && {FELT}")
        to(window, "Feel")
        window.wait("document.querySelector('.side .q-toggle')")
        window.click(".side .q-toggle")
        # A canvas is 300 pixels wide before it has heights.
        window.wait("document.querySelector('.brush')?.offsetParent")
        window.wait("document.querySelector('.mask').width != 300")
        left, top, width, height = window.place(".brush")

        def stroke(share: float) -> None:
            before, x = window.evaluate(COMMAND), left + share * width
            window.drag([(x, top + 0.1 * height), (x, top + 0.9 * height)])
            window.wait(f"{COMMAND} != {json.dumps(before)}")

        stroke(0.25)
        slider = ".side input[aria-label^=share]"
        window.evaluate(f"document.querySelector('{slider}').value = 40")
        window.evaluate(f"document.querySelector('{slider}').dispatchEvent(new Event('input'))")
        window.wait("document.querySelector('.side').innerText.includes('40 % of the way')")
        stroke(0.75)
        mask = re.search(r'"(pictures/mask-\w+\.png)"', window.evaluate(COMMAND))
        assert mask is not None
        greys = np.asarray(Image.open(tmp_path / mask[1])) / 255.0
        middle = greys[len(greys) // 2]
        shares = [middle[round(share * len(middle))] for share in (0.25, 0.5, 0.75)]
        assert np.allclose(shares, [1.0, 0.0, 0.4], atol=0.01)
        window.key("z", control=True)
        window.wait(f"!{COMMAND}.includes({json.dumps(mask[1])}) && {COMMAND}.includes('graded')")
        to(window, "Run")
        window.click_text(".side button", "Run")
        window.wait(DONE)
        to(window, "Compare")
        window.click_text(".ways button", "Feel")
        window.wait("document.querySelectorAll('.felt-places ellipse').length > 16")
        assert whole(window) == []


def test_a_run_with_a_printer_is_compared_shown_and_printed(window: Window, tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    feel = {"printer": "filament", "jnd": 1.0, "settings": QUICK}
    (tmp_path / "runs" / "app.json").write_text(json.dumps({"document": {"feel": feel}, "queue": []}))
    with App(tmp_path, "gravel") as app:
        window.visit(app.address, 1280, 800)
        window.wait(f"{SHOWN} && {FELT}")
        to(window, "Run")
        assert window.evaluate("document.querySelector('.side').innerText.includes('printed by filament')")
        window.click_text(".side button", "Run")
        window.wait("/-1: (done|ended)/.test(document.querySelector('.state')?.innerText)")
        # The heights of both, as two of one grid have an edge between them.
        window.wait(f"{SHOWN}.trim().split(' ').length == 2")
        side = "document.querySelector('.side').innerText"
        if window.evaluate("document.querySelector('.state').innerText.includes('ended')"):
            assert window.evaluate(f"{side}.includes('target')")
        window.click_text(".side button", "Compare")
        window.wait(f"{SHOWN}.trim().split(' ').length == 2")
        window.click_text(".ways button", "Change")
        window.wait("document.querySelector('.map img')?.offsetParent")
        to(window, "Object")
        window.click_text(".side button", "Show")
        window.wait("document.querySelector('iframe')?.offsetParent")
        to(window, "Print")
        window.click_text("button", "Write the file")
        window.wait(f"{side}.includes('200 µm')")
        assert window.evaluate("[...document.querySelectorAll('.fault')].every((one) => !one.innerText)")
        assert whole(window) == []


def test_a_draft_follows_the_slider_by_mouse_and_by_keys(window: Window, tmp_path: Path) -> None:
    state = "document.querySelector('.draft .state')?.innerText"

    def drafted() -> float:
        """Wait for a draft of the feel at which the slider stands; returns how many JND it reaches."""
        value = "Number(document.querySelector('.jnd-slider input').value)"
        reached = f"Number({state}.match(/([+−][0-9.]+) JND/)[1].replace('−', '-'))"
        window.wait(f"{COMMAND}.includes(`--jnd=${{{value}}} `)")
        window.wait("document.querySelector('.busy').innerText != 'drafting'")
        window.wait(f"/^Draft: /.test({state}) && Math.abs({reached} - {value}) < 0.15")
        return float(window.evaluate(reached))

    with App(tmp_path, "dots") as app:
        window.visit(app.address, 1280, 800)
        window.wait(f"{SHOWN} && {FELT}")
        to(window, "Feel")
        window.wait("document.querySelector('.jnd-slider input')")
        drafted()
        # The original's heights and those of the draft.
        window.wait(f"{SHOWN}.trim().split(' ').length == 2")
        before = window.evaluate(SHOWN)
        left, top, width, height = window.place(".jnd-slider input")
        window.drag([(left + width * share, top + height / 2) for share in (0.65, 0.68, 0.71, 0.74, 0.76)])
        window.wait(f"!{COMMAND}.includes('--jnd=2 ')")
        assert drafted() > 2.8
        window.wait(f"{SHOWN} != {json.dumps(before)}")
        for _ in range(3):
            window.key("ArrowLeft")
        assert drafted() < 3.2
        assert window.evaluate("document.querySelector('.draft img').src.startsWith('data:image/png')")
        area = f"{state}.includes('contact area')"
        for goal, expected in (("Contact area", area), ("Like another", f"!{area}")):
            window.click_text(".choice button", goal)
            # Brick is 6 JND smoother than dots, and its draft may fall short.
            window.wait(f"/^(Draft|Nearest so far): /.test({state}) && {expected}")
        assert not list((tmp_path / "runs").glob("dots-*"))
        assert whole(window) == []


@pytest.mark.sentinel
def test_two_windows_show_one_session(app: App, window: Window) -> None:
    window.visit(app.address, 1280, 800)
    window.wait(SHOWN)
    with window.another() as other:
        other.visit(app.address, 1280, 800)
        other.wait(SHOWN)
        other.click(".gallery button[title=brick]")
    window.wait(f"{COMMAND}.includes('prepare brick')")


def test_without_webgl_the_lamp_moves_on_a_canvas(app: App) -> None:
    total = """document.querySelector(".relief-stage canvas").getContext("2d")
      .getImageData(0, 0, 200, 200).data.reduce((sum, each) => sum + each, 0)"""
    with Window() as plain:
        plain.visit(app.address, 1280, 800)
        plain.wait(SHOWN)
        plain.wait(f"{total} > 255 * 200 * 200")
        before = plain.evaluate(total)
        left, top, width, height = plain.place(".relief-stage")
        plain.drag([(left + 0.5 * width, top + 0.5 * height), (left + 0.95 * width, top + 0.5 * height)])
        plain.wait(f"Math.abs({total} - {before}) > 2 * 200 * 200")
        assert whole(plain) == []


def test_a_closed_app_leaves_a_run_that_goes_on(window: Window, tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    slow = {"settings": [*QUICK, "descent.method=adam", "descent.steps=5000"]}
    (tmp_path / "runs" / "app.json").write_text(json.dumps({"document": {"feel": slow}, "queue": []}))
    with App(tmp_path, "waves") as app:
        window.visit(app.address)
        window.wait(SHOWN)
        to(window, "Run")
        window.click_text(".side button", "Run")
        window.wait("document.querySelectorAll('.step-chart .dot').length > 1")
        assert app.close() == 0
    assert (tmp_path / "runs" / "waves-1" / "heights.exr").is_file()
    with App(tmp_path) as app:
        window.visit(app.address)
        window.wait(SHOWN)
        to(window, "Run")
        window.wait("document.querySelector('.queue')?.innerText.includes('it can go on')")


def test_a_killed_app_leaves_a_run_that_the_next_one_shows_and_stops(window: Window, tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    slow = {"settings": [*QUICK, "descent.method=adam", "descent.steps=5000"]}
    content = {"document": {"feel": slow}, "queue": [], "of_a_later_version": 1}
    (tmp_path / "runs" / "app.json").write_text(json.dumps(content))
    dots = "document.querySelectorAll('.step-chart .dot').length"
    with App(tmp_path, "waves") as app:
        window.visit(app.address)
        window.wait(SHOWN)
        window.wait("document.querySelector('.bar .fault').innerText.includes('runs/app.json.unread-1')")
        to(window, "Run")
        window.click_text(".side button", "Run")
        window.wait(f"{dots} > 1")
        app.process.kill()
        app.close()
    with App(tmp_path) as app:
        window.visit(app.address)
        window.wait(SHOWN)
        assert window.evaluate("document.querySelector('.bar .fault').innerText") == ""
        to(window, "Run")
        window.wait("/waves-1: running/.test(document.querySelector('.state')?.innerText)")
        window.wait("document.querySelector('.stage').innerText.includes('right the best so far')")
        window.click_text(".side button", "Stop")
        window.wait("document.querySelector('.queue')?.innerText.includes('it can go on')")
    assert (tmp_path / "runs" / "waves-1" / "heights.exr").is_file()
