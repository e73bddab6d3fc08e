"""Feel between the steered places, from the files of a run."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.run_file import run_from_scene
from relief.heightmap import load_heights, save_heights_exr
from relief.places import between
from relief.relief import Relief
from relief.surface import Surface
from retouch.laboratory.studies.measuring.between import felt_between
from retouch.laboratory.studies.measuring.measures import MEASURES
from tactile.jnd import ROUGHNESS_JND
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS
from tests.retouch.pages.plausible import verified

SIDE, MESH = 32, 16
ANGLE = 2 * np.pi * (np.arange(SIDE) + 0.5) / SIDE
BOTH = (True, True)
TILE = 0.5 + 0.25 * np.cos(4 * ANGLE)[:, None] * np.cos(4 * ANGLE)
"""A relief of period 2.5 mm, the distance of the places, so that all of them feel alike."""


def run_of(folder: Path, after: NDArray[np.float64], *settings: str, **sections: Any) -> FinishedRun:
    """A run in a folder with the result ``after`` of the texture `TILE`, and sections of its verification."""
    np.save(folder / "tile.npy", TILE)
    save_heights_exr(folder / "heights.exr", after, 10.0, 3.0)
    (folder / "result.json").write_text(json.dumps(verified(**sections).as_json()))
    each = ["touch.jnd=1", f"define.resolution={SIDE}", f"verify.resolution={MESH}", *settings]
    return FinishedRun(folder, run_from_scene("studio", folder / "tile.npy", each))


def test_places_that_are_alike_feel_the_same_change(tmp_path: Path) -> None:
    run = run_of(tmp_path, 1.2 * TILE, "repeats=true")
    found = felt_between(run)
    assert found.keys() == MEASURES["places"].columns.keys()
    at = between(Surface((SIDE, SIDE), 10.0, BOTH))[:1]
    before, after = (
        measure_touch(Relief(heights, 10.0, BOTH), run.settings.touch.finger, "fem", MESH, at=at).values[
            ROUGHNESS.name
        ]
        for heights in (TILE, load_heights(tmp_path / "heights.exr"))
    )
    jnd = float(np.log(after / before)[0] / np.log(ROUGHNESS_JND))
    assert jnd > 0.2
    for name in ("mean", "least", "most"):
        assert found[f"between_{name}_jnd"] == pytest.approx(jnd, abs=1e-4)
    assert found["between_count"] == 16
    assert found["between_off_jnd"] == pytest.approx(jnd - 1.0, abs=1e-4)
    assert found["between_worst_jnd"] == pytest.approx(abs(jnd - 1.0), abs=1e-4)


def test_a_change_at_one_place_is_the_worst_there_and_the_spacing_of_a_run_adds_no_gap(
    tmp_path: Path,
) -> None:
    after = TILE.copy()
    after[:8, :8] *= 1.5
    found = felt_between(run_of(tmp_path, after, "repeats=true", "touch.spacing_mm=10"))
    least, mean, most = (found[f"between_{name}_jnd"] for name in ("least", "mean", "most"))
    assert least is not None and mean is not None and most is not None
    assert least < mean < most
    assert found["between_count"] == 16


def test_what_the_run_has_pressed_is_not_pressed_again(tmp_path: Path) -> None:
    between = {"initial_roughness": [0.05, 0.06], "verified_roughness": [0.05 * ROUGHNESS_JND, 0.06]}
    each = {"count": 2, "centres_mm": [[0.0, 0.0], [5.0, 5.0]], **between}
    touch = {"verified_by": "fem", "places": {"count": 4, "steered": each, "between": each}}
    found = felt_between(run_of(tmp_path, TILE, "repeats=true", touch=touch))
    assert found["between_count"] == 2 and found["between_most_jnd"] == pytest.approx(1.0)
    for settings, felt in (
        (["touch.spacing_mm=10"], touch),
        ([], touch | {"verified_by": "layer"}),
    ):
        other = run_of(tmp_path, TILE, "repeats=true", *settings, touch=felt)
        assert felt_between(other)["between_count"] == 16


def test_a_plate_with_one_place_has_none_between(tmp_path: Path) -> None:
    assert set(felt_between(run_of(tmp_path, TILE)).values()) == {None}


def test_a_target_in_another_unit_has_no_distance_in_jnd(tmp_path: Path) -> None:
    run = run_of(tmp_path, TILE, "repeats=true", "touch.contact_area_scale=0.9")
    touch = run.settings.touch.model_copy(update={"jnd": None})
    found = felt_between(replace(run, settings=run.settings.model_copy(update={"touch": touch})))
    assert found["between_off_jnd"] is None and found["between_worst_jnd"] is None
    assert found["between_mean_jnd"] == pytest.approx(0.0, abs=1e-3)
