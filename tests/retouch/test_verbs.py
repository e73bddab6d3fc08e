"""Arguments of the functions behind the verbs that contradict one another."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import retouch
from relief.ground.errors import InputError
from relief.printers import PRINTERS
from relief.relief import as_relief
from tactile import measures

HEIGHTS = np.linspace(0.0, 0.5, 64)[:, None] * np.ones(64)
RELIEF = retouch.Relief.of(HEIGHTS)
TILE = retouch.Relief.of(np.zeros((64, 64)), repeats=True)
PRINTED = retouch.Relief.of(HEIGHTS + 0.1).printed(next(iter(PRINTERS.values())))
OTHER = list(PRINTERS)[1]


@pytest.mark.parametrize(
    ("call", "line"),
    [
        (lambda: retouch.evaluate(RELIEF, size_mm=12.0), "size_mm: is for files and arrays"),
        (lambda: retouch.evaluate(RELIEF, repeats="x"), "repeats: is for files and arrays"),
        (lambda: retouch.evaluate(TILE, repeats=False), "repeats: is for files and arrays"),
        (lambda: retouch.evaluate(RELIEF, relief_mm=1.0), "relief_mm: is for files"),
        (lambda: retouch.evaluate(HEIGHTS, height_scale=2.0), "height_scale: is for files"),
        (lambda: retouch.evaluate(HEIGHTS, units="in"), "units: is for files"),
        (lambda: retouch.evaluate(PRINTED, printer=OTHER), "printer: heights is a print already"),
        (lambda: retouch.render("studio", texture=RELIEF, repeats=True), "repeats: is for files and arrays"),
        (lambda: retouch.load_scene("studio", relief=RELIEF, size_mm=12.0), "size_mm: is for files and arr"),
        (lambda: retouch.load_scene("studio", relief=RELIEF, texture="a.exr"), "texture: a.exr: there is a"),
    ],
)
def test_an_argument_without_effect_is_refused(call: Callable[[], object], line: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(line)}"):
        call()


def test_a_print_is_not_printed_again(tmp_path: Path) -> None:
    out = tmp_path / "plate.stl"
    with pytest.raises(InputError, match="is a print already"):
        retouch.export(PRINTED, out, printer=OTHER)
    assert not out.exists()


def test_an_array_is_as_wide_as_the_call_says_or_by_default() -> None:
    assert as_relief(HEIGHTS, 12.0, default_mm=25.0).width_mm == 12.0
    assert as_relief(HEIGHTS, default_mm=25.0).width_mm == 25.0
    assert as_relief(RELIEF, default_mm=25.0) is RELIEF


@pytest.mark.slow
def test_a_finely_sampled_plate_says_at_how_many_places_all_samples_were_pressed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(measures, "MOST_SAMPLES", 4 * 140**2 - 1)
    monkeypatch.setattr(measures, "FULL_SAMPLES", 2 * 140**2)
    heights = np.tile(np.linspace(0.0, 0.5, 35)[:, None], (5, 175))
    found = retouch.evaluate(heights, size_mm=12.5, skin=retouch.Skin())
    places = found.as_json()["places"]
    assert (places["count"], places["count_full_sampling"]) == (4, 2) == (found.places.count, 2)
    (line,) = found.lines()
    assert line.startswith(
        "heights: 2 of 4 places were pressed with all their samples, the others with fewer; "
    )
