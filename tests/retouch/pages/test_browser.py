"""The pages in a real browser: they ask for nothing, complain of nothing and cut nothing off."""

import os
import tempfile
from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.docs.pages import WIDTHS, faults
from benchmarks.shared.browser import Browser, chromium
from relief.relief import Relief
from retouch.pages.compared import Compared
from retouch.pages.comparison import write_comparison
from retouch.pages.content import Comparison, Pair, Report
from retouch.pages.page import write_report
from tests.retouch.pages.plausible import FINGERS, noisy, verified

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(chromium() is None, reason="no Chromium here"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as open_browser:
        yield open_browser


@pytest.mark.parametrize("webgl", [False, True])
def test_a_browser_leaves_nothing_behind(webgl: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    # Of a short name: the browser makes a socket in it.
    with tempfile.TemporaryDirectory() as folder:
        monkeypatch.setenv("TMPDIR", folder)
        monkeypatch.setattr(tempfile, "tempdir", None)
        with Browser(webgl=webgl) as one:
            one.open("about:blank", 800)
            assert len(os.listdir(folder)) > 1
        assert os.listdir(folder) == []


def full() -> Report:
    """A report with every section, the widest numbers, and a condition of a long name."""
    report = noisy("known", "The noise of the pictures is small beside their change.")
    iterations = [
        {
            **{
                "steps": 12,
                "surrogate_target_roughness": 0.0676,
                "roughness": 0.0676,
                "verified_roughness": 0.0681,
            },
            "relative_error": 0.0102,
        }
    ] * 2
    names = ["light-10", "light-130", "a-lamp-in-the-far-corner-of-the-workshop"]
    look = report.verification.look.as_json()
    return replace(
        report,
        verification=verified(look=look, verification={"resolution": 64, "outer_iterations": iterations}),
        conditions=names,
        settings={"scene": "/" + 30 * "folder/" + "s.xml"},
    )


def comparison() -> Comparison:
    report = full()
    shared: dict[str, Any] = {field.name: getattr(report, field.name) for field in fields(Pair)}
    side = {
        **{"file": "/" + 12 * "folder/" + "texture.png", "size_mm": 10.0, "relief_mm": 1.2},
        **{"samples": 64, "rows": 48},
        **{"roughness": 0.0478, "contact_area_mm2": 31.7, "contact_fraction": 0.23},
    }
    result = {
        **{"first": side | {"name": "A"}, "second": side | {"name": "B", "roughness": 0.0123}},
        **{"jnd_apart": -7.8, "told_apart_probability": 1.0, "no_look": None, "scene": "studio.xml"},
        **{"skin": {"young_modulus_mpa": 0.5, "poisson_ratio": 0.48, "force_n": 10.0}, "model": "layer"},
        **{"places": None, "fingers": FINGERS},
        "look": report.verification.look.as_json(),
    }
    sides = {name: replace(shared[name], name=word) for name, word in (("before", "A"), ("after", "B"))}
    numbers = Compared.model_validate(result)
    return Comparison(**shared | sides | {"title": "gravel and texture"}, numbers=numbers)


def touch_alone() -> Comparison:
    """Two plates of different sizes and grids, whose pictures are not compared."""
    whole = comparison()
    none = np.zeros((0, 1, 1))
    finer = whole.after.relief.heights.repeat(2, axis=0).repeat(2, axis=1)
    reason = {"look": None, "no_look": "A is 10 mm wide and B 16 mm."}
    return replace(
        whole,
        conditions=(),
        before=replace(whole.before, pictures=none),
        after=replace(whole.after, pictures=none, relief=Relief(finer, 16.0)),
        numbers=whole.numbers.model_copy(update=reason),
    )


@pytest.mark.parametrize("kind", ["report", "comparison", "touch alone"])
def test_a_page_is_whole_on_every_screen(kind: str, browser: Browser, tmp_path: Path) -> None:
    if kind == "report":
        (tmp_path / "plate.stl").touch()
        page = write_report(tmp_path, full())
    else:
        page = write_comparison(
            tmp_path / "page.html", comparison() if kind == "comparison" else touch_alone()
        )
    assert {width: faults(browser, page, width) for width in WIDTHS} == {width: [] for width in WIDTHS}


def test_blinking_shows_one_picture_after_the_other(browser: Browser, tmp_path: Path) -> None:
    browser.open(write_comparison(tmp_path / "page.html", comparison()), 1280)
    split = "document.querySelector('.pair').style.getPropertyValue('--split')"
    for key, pressed in (("b", "true"), ("B", "false")):
        browser.evaluate(f"dispatchEvent(new KeyboardEvent('keydown', {{ key: '{key}' }}))")
        assert browser.evaluate("document.getElementById('blink').getAttribute('aria-pressed')") == pressed
        assert (browser.evaluate(split) in ("0%", "100%")) == (pressed == "true")


def test_the_profile_follows_its_slider(browser: Browser, tmp_path: Path) -> None:
    """On both plates, which have different grids."""
    page = touch_alone()
    browser.open(write_comparison(tmp_path / "page.html", page), 1280)
    drawn = browser.evaluate("""(() => {
      const slider = document.querySelector(".chooser input");
      slider.value = 3;
      slider.dispatchEvent(new Event("input"));
      return [...document.querySelectorAll("path.row")].map((path) => path.getAttribute("d"));
    })()""")
    for path, heights, row in zip(drawn, [side.relief.heights for side in page.sides], (3, 7), strict=True):
        across, down = np.array([point.split() for point in path[1:].split("L")], dtype=float).T
        assert len(across) == heights.shape[1]
        np.testing.assert_allclose(np.diff(-down), np.diff(heights[row]), atol=2e-3)


def test_the_check_finds_what_is_wrong(browser: Browser, tmp_path: Path) -> None:
    page = tmp_path / "bad.html"
    page.write_text(
        "<body style='margin:0'><p style='width:3em;overflow:hidden;white-space:nowrap'>a long line</p>"
        "<table><tr><td style='width:0'>light-10</td></tr></table><img src='missing.png'>"
        "<script>console.log('hello')</script>"
    )
    found = " ".join(faults(browser, page, 390))
    for fault in ("asks for file:", "complains:", 'cut off: "a long line"', 'broken: "light-10"'):
        assert fault in found
