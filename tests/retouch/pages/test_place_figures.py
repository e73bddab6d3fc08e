"""The page shows what was felt at every place, beside what was wanted there."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from relief.places import between, centres_mm, places
from relief.relief import Relief
from relief.surface import Surface
from retouch.pages.content import Report
from retouch.pages.page import write_report
from tests.retouch.pages.outline import Outline
from tests.retouch.pages.plausible import plausible, verified, with_sides

TILE = Surface((64, 64), 10.0, (True, True))
STRIP = Surface((16, 64), 40.0)


def sections_of(surface: Surface, factor: Any) -> dict[str, Any]:
    """Places that are each off their targets by 0.1 JND, between steered ones by -0.2."""
    sections: dict[str, Any] = {"count": 0}
    for name, found, off in (("steered", places(surface), 0.1), ("between", between(surface), -0.2)):
        centres = centres_mm(surface, found)
        original = np.linspace(0.04, 0.06, len(centres))
        target = original * factor(centres)
        sections[name] = {
            "count": len(centres),
            "centres_mm": centres.tolist(),
            "initial_roughness": original.tolist(),
            "target_roughness": target.tolist(),
            "verified_roughness": (target * 1.19**off).tolist(),
        }
        sections["count"] += len(centres)
    return sections


def report_of(surface: Surface, sections: dict[str, Any]) -> Report:
    report = plausible()
    relief = Relief(np.resize(report.after.relief.heights, surface.shape), surface.width_mm, surface.repeats)
    return replace(
        with_sides(report, relief=(relief, relief)), verification=verified(touch={"places": sections})
    )


def test_a_tile_shows_the_change_and_the_distance_of_each_place(tmp_path: Path) -> None:
    text = write_report(tmp_path, report_of(TILE, sections_of(TILE, lambda centres: 1.19**2))).read_text(
        "utf-8"
    )
    words = " ".join(Outline(text).text.split())
    assert "16 places that the descent steered and, afterwards, on 16 between them" in words
    assert "+1.95 just-noticeable differences (JND) on average, +1.80 to +2.10" in words
    assert "beyond the dashed line" in words
    # Places on the border of the period are shown on both sides of it.
    assert words.count("+2.10") - 1 == words.count("+0.10") == 25
    assert words.count("+1.80") - 1 == words.count("\N{MINUS SIGN}0.20") == 16
    assert "Roughness along the surface" not in words


def test_a_strip_shows_a_target_that_varies_beside_what_was_reached(tmp_path: Path) -> None:
    report = report_of(STRIP, sections_of(STRIP, lambda centres: 1.0 + centres[:, 1] / 40.0))
    text = write_report(tmp_path, report).read_text("utf-8")
    names = re.findall(r'<figure class="places"><figcaption class="name">(.*?)<', text)
    assert names == ["Original", "Target", "Reached", "Distance from the target"]
    assert "Roughness along the surface" in text
    words = " ".join(Outline(text).text.split())
    assert "just-noticeable differences from the original, as wanted of each place" in words
    assert "of 100 tries" not in words
    assert text.count("<ellipse") == 4 * (13 + 12)
    assert text.count('class="steered"') == 4 * 13


def test_a_flat_place_is_grey(tmp_path: Path) -> None:
    sections = sections_of(TILE, lambda centres: 1.19**2)
    first = sections["between"]
    first["initial_roughness"][0] = first["verified_roughness"][0] = first["target_roughness"][0] = 0.0
    text = write_report(tmp_path, report_of(TILE, sections)).read_text("utf-8")
    assert "nan" not in Outline(text).text
    assert text.count("rgb(221, 218, 212)") == 2


def test_one_place_has_no_map(tmp_path: Path) -> None:
    assert "Wherever the finger lands" not in write_report(tmp_path, plausible()).read_text("utf-8")
