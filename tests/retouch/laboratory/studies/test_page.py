"""The page of a study shows its rows, asks for nothing, and believes nothing that a file says."""

import json
import re
from collections.abc import Mapping
from html import unescape
from pathlib import Path

import numpy as np
import pytest

from benchmarks.docs.pages import WIDTHS, faults
from benchmarks.shared.browser import Browser, chromium
from retouch.laboratory.studies.document import RowOfTable, StudyDocument, TableOfDocument
from retouch.laboratory.studies.page import page
from retouch.laboratory.studies.plots import charts, interval, mean_over
from retouch.laboratory.studies.records import Cell, Record
from retouch.laboratory.studies.study_file import Plot

HOSTILE = "</script><script>alert(1)</script>"
TEXTURES = ["gravel", "brick", "grass", "a texture of a long name"]


def document(plots: list[Plot], failed: int = 0, missing: int = 0) -> StudyDocument:
    """A study of textures, targets and models, whose change is 1, 2, ... % for the textures."""
    rows, records, failures = [], {}, {}
    for number, (texture, jnd, model) in enumerate(
        (t, jnd, model) for t in TEXTURES for jnd in (-2.0, 0.5, 2.0) for model in ("exact", "fast")
    ):
        key = f"{number:064x}"
        labels: dict[str, Cell] = {"texture": texture, "touch.jnd": jnd, "look.model": model}
        rows.append(RowOfTable(labels=labels, key=key))
        change = (1.0 + TEXTURES.index(texture)) * (2.0 if model == "fast" else 1.0)
        columns: dict[str, Cell] = {
            **{"reason": "short_of_target", "change_percent": change, "jnd_from_original": jnd, "steps": 7},
            **{"miss_percent": 0.00164, "time_s.total": 33.3, "verified_by": HOSTILE, "flip": None},
        }
        if number < failed:
            failures[key] = f"ContactError: not converged {HOSTILE}"
        elif number >= failed + missing:
            records[key] = Record(key=key, columns=columns)
    axes: dict[str, list[Cell]] = {
        "texture": list(TEXTURES),
        "touch.jnd": [-2.0, 0.5, 2.0],
        "look.model": ["exact", "fast"],
    }
    return StudyDocument(
        study="s",
        title=f"Models {HOSTILE}",
        description="Six targets.",
        quick=True,
        tables=[TableOfDocument(name="look", axes=axes, rows=rows)],
        records=records,
        failures=failures,
        faults=[f"{'/folder' * 20}/study.toml: look: texture x: no such file"],
        plots=plots,
    )


PLOTS = [
    Plot(x="touch.jnd", y="change_percent", by="look.model", over="texture"),
    Plot(x="texture", y="change_percent", by="look.model"),
    Plot(x="look.model", y="time_s.total"),
    Plot(x="time_s.total", y="change_percent", by="look.model", over="texture"),
    Plot(x="nowhere", y="change_percent"),
    Plot(x="texture", y="flip"),
]


def test_text_of_files_stays_text(tmp_path: Path) -> None:
    text = page(document(PLOTS, failed=2, missing=3), tmp_path).decode()
    assert text.count("<script") == 4 and "alert(1)" in text
    (data,) = re.findall(r'<script type="application/json" id="details">(.*?)</script>', text, re.DOTALL)
    rows = json.loads(data)
    assert len(rows) == 19 and all(row["pictures"] == [] for row in rows.values())
    assert {row["numbers"]["verified_by"] for row in rows.values()} == {HOSTILE}
    assert text.count("ContactError: not converged") == 2 and "3 not computed yet" in text
    assert "Models &lt;/script&gt;" in text


def test_the_page_asks_for_pictures_of_its_own_folder_alone(tmp_path: Path) -> None:
    text = unescape(page(document([]), tmp_path).decode())
    assert "default-src 'none'; img-src data: 'self' file:;" in text
    assert not re.search(r"""(src|href)\s*=\s*["']?\s*(https?:)?//""", text)


def test_plots_are_drawn_for_the_axes_that_a_table_has() -> None:
    drawn, note = charts(document(PLOTS))
    assert len(drawn) == 4 and "95 % intervals" in note
    assert drawn[0].count('class="s0 dot"') == 3 and drawn[0].count('class="s1 interval"') == 3
    assert (
        drawn[1].count('class="mark"') == 8 and "exact" in drawn[1] and "a texture of a long name" in drawn[1]
    )
    assert drawn[3].count('dot"') == 2
    assert len(charts(document([]))[0]) == 2
    _, note = charts(document(PLOTS[:1], failed=23))
    assert note.startswith("Each point is of a single row")


def test_a_line_from_smoother_to_rougher_goes_through_no_change() -> None:
    def line(x: str, *places: float) -> tuple[str, str]:
        keys = [f"{number:064x}" for number in range(len(places))]
        rows = [RowOfTable(labels={x: place}, key=key) for key, place in zip(keys, places, strict=True)]
        records = {key: Record(key=key, columns={"change_percent": 2.0}) for key in keys}
        whole = document([Plot(x=x, y="change_percent")]).model_copy(
            update={
                "tables": [TableOfDocument(name="t", axes={x: list(places)}, rows=rows)],
                "records": records,
            }
        )
        (chart,), note = charts(whole)
        return re.findall(r'class="s0" d="([^"]*)"', chart)[0], note

    through, note = line("touch.jnd", -1.0, 2.0)
    points = [tuple(map(float, point.split())) for point in through.removeprefix("M").split("L")]
    assert len(points) == 3 and points[0][1] == points[2][1] < points[1][1] == 100.0
    assert (points[1][0] - points[0][0]) / (points[2][0] - points[0][0]) == pytest.approx(1 / 3, abs=1e-3)
    assert "go through 0" in note
    for x, places in (
        ("touch.jnd", (1.0, 2.0)),
        ("touch.jnd", (-1.0, 0.0, 2.0)),
        ("look.weight", (-1.0, 2.0)),
    ):
        drawn, note = line(x, *places)
        assert drawn.count("L") == len(places) - 1 and "go through 0" not in note


def test_a_bootstrap_interval_is_as_wide_as_a_mean_is_uncertain() -> None:
    values = np.random.default_rng(3).normal(5.0, 2.0, 400).tolist()
    low, high = interval(values)
    half = 1.96 * np.std(values) / np.sqrt(len(values))
    assert (high - low) / 2 == pytest.approx(half, rel=0.1)
    assert (high + low) / 2 == pytest.approx(np.mean(values), abs=0.2 * half)
    assert interval([3.0]) == (3.0, 3.0) and interval([3.0, 3.0]) == (3.0, 3.0)


def test_a_mean_over_an_axis_is_of_the_means_of_its_values() -> None:
    rows: list[Mapping[str, Cell]] = [
        {"texture": "a", "y": 1.0},
        {"texture": "a", "y": 3.0},
        {"texture": "b", "y": 8},
        {"texture": "b", "y": None},
    ]
    mean = mean_over(rows, "y", "texture", 0.0)
    assert mean is not None and (mean.value, mean.count, mean.low, mean.high) == (5.0, 2, 2.0, 8.0)
    alone = mean_over(rows, "y", None, 0.0)
    assert alone is not None and (alone.value, alone.count) == (4.0, 3)
    assert mean_over(rows[-1:], "y", None, 0.0) is None


@pytest.mark.slow
@pytest.mark.skipif(chromium() is None, reason="no Chromium here")
def test_the_page_in_a_browser(tmp_path: Path) -> None:
    file = tmp_path / "index.html"
    file.write_bytes(page(document(PLOTS, failed=1, missing=1), tmp_path))
    with Browser() as browser:
        for width in WIDTHS:
            assert faults(browser, file, width) == []
        browser.open(file, WIDTHS[1])
        assert browser.evaluate("document.querySelectorAll('tr.opened').length") == 0
        browser.evaluate("document.querySelectorAll('table.rows tbody button')[3].click()")
        assert "miss_percent" in browser.evaluate("document.querySelector('tr.opened').textContent")
        # Column 2 is the target, a number; the first click sorts up, the second down.
        values = "[...document.querySelectorAll('table.rows tbody tr')].map(r => r.children[1].dataset.value)"
        for order in (1, -1):
            browser.evaluate("document.querySelectorAll('table.rows th button')[1].click()")
            found = [float(value) for value in browser.evaluate(values)]
            assert len(found) == 24 and found == sorted(found)[::order]
        browser.evaluate("document.querySelector('table.rows thead th:nth-child(6) button').click()")
        values = values.replace("children[1].dataset", "children[5]?.dataset")
        assert browser.evaluate(values)[-1] in ("", None) and len(browser.evaluate(values)) == 24
