"""Run time against error: curves of runs, and the seconds that they take to a change of the pictures."""

import math
from typing import Any

import pytest

from benchmarks.runs import pareto

RESULT = {
    "stop": {"best_step": 2},
    "touch": {"verified_roughness": 0.0505, "target_roughness": 0.05},
    "look": {"change_percent": 2.0},
    "cpu_s": {"descent": 8.0, "verify": 3.0},
    "time_s": {"descent": 4.0},
}


def history() -> list[dict[str, Any]]:
    rows = [(0, 0.04, 0.0, 0.0), (1, 0.0495, 6.0, 1.0), (2, 0.05, 4.0, 2.0), (3, 0.05, 3.0, 4.0)]
    keys = ("step", "roughness", "picture_mean_percent", "seconds")
    return [dict(zip(keys, row, strict=True)) for row in rows]


def test_a_curve_goes_through_the_verified_result() -> None:
    found = pareto.curve(RESULT, history())
    assert found == [
        pytest.approx((5.0, 0.01, 3.0)),
        pytest.approx((7.0, 1.0, 2.0)),
        pytest.approx((11.0, 1.0, 1.5)),
    ]


def run(way: str, change: float, miss: float = 0.1) -> dict[str, Any]:
    result = {"case": "gravel +2", "way": way, "steps": 2, "miss_percent": miss, "change_percent": change}
    curve = [(5.0, 2.0, 1.0), (6.0, 0.5, 1.04 * change), (9.0, 0.1, change)]
    others = {"cpu_s": {"descent": 6.0, "verify": 3.0}, "change_rms_percent": 4.0, "curve": curve}
    return {**result, **others, "change_fine_rms_percent": None}


def test_seconds_are_to_the_first_step_on_target() -> None:
    row = run("scaling", 2.0)
    assert pareto.seconds_to(row, 2.1) == 6.0
    assert pareto.seconds_to(row, 2.04) == 9.0
    assert math.isnan(pareto.seconds_to(row, 1.9))


def test_the_best_meets_its_target_and_rows_are_told_in_order() -> None:
    ways = ["gauss-newton, quick, fast", "scaling"]
    rows = {f"gravel +2: {way}": run(way, change) for way, change in zip(ways, (2.0, 2.16), strict=True)}
    rows["gravel +2: adam, layer, exact"] = run("adam, layer, exact", 1.5, miss=1.2)
    assert pareto.best_known(rows, "gravel +2") == 2.0
    lines = [[cell.strip() for cell in line.split("|")] for line in pareto.as_text(rows).splitlines()]
    assert [line[2] for line in lines[2:]] == ["scaling", "gauss-newton, quick, fast", "adam, layer, exact"]
    assert lines[2][3:6] == ["9", "-", "-"]
    assert lines[3][3:6] == ["6", "6", "9"]


def test_pictures_are_drawn(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pareto, "PICTURE", tmp_path / "pareto.png")
    pareto.draw({f"gravel +2: {way}": run(way, 2.0) for way in pareto.WAYS})
    assert (tmp_path / "pareto.png").is_file()
