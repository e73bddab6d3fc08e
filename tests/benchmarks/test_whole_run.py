"""Whole runs of versions in turns: which are due, what is counted as touch, and what rows say."""

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from benchmarks import whole_run
from benchmarks.runs import turns
from benchmarks.shared import touch_clock
from benchmarks.shared.checkouts import module_of
from benchmarks.shared.common import ROOT
from optimize.settings.run_file import load_run
from relief.relief import Relief

BEFORE, NOW = "340f9f0", "abc1234"
HERE = {"cpu": "one", "cores": 2}


def row(case: str, version: str, **numbers: float) -> dict[str, Any]:
    usual = {
        "cpu_s": 10.0,
        "touch_cpu_s": 4.0,
        "descent_cpu_s": 6.0,
        "steps": 3,
        "peak_mb": 700.0,
        "places": 1,
    }
    found = {"off_target_percent": 0.5, "change_rms_percent": 4.0}
    return {"case": case, "version": version, "machine": HERE, **usual, **found, **numbers}


def test_cases_are_those_that_have_an_aim() -> None:
    groups = Counter(case.group for case in turns.CASES.values())
    assert turns.AIMS.keys() == groups.keys() - {"40 mm, 512 samples"}
    assert groups["demo runs, exact"] == groups["demo runs, fast"] == 6


@pytest.mark.parametrize("name", turns.CASES)
def test_the_settings_of_a_case_are_sound(name: str) -> None:
    options = turns.CASES[name].options
    settings = [options[place + 1] for place, option in enumerate(options) if option == "--set"]
    assert load_run(options[0], (*settings, *turns.SHORT)).descent.steps == 1


def test_textures_of_cases_have_their_samples(tmp_path: Path) -> None:
    for case in (turns.CASES["256x256"], turns.CASES["25mm-500"]):
        assert case.texture is not None
        relief = Relief.read(case.texture(tmp_path))
        assert (relief.surface.width_mm, *relief.heights.shape) == (case.size_mm, *[case.samples] * 2)


def test_versions_take_turns_and_runs_that_are_done_are_not_due() -> None:
    names = ["tile", "80mm-1024"]
    due = turns.missing([], names, [BEFORE, NOW], repeats=2)
    assert due == [
        *(("tile", BEFORE), ("tile", NOW), ("tile", BEFORE), ("tile", NOW)),
        *(("80mm-1024", BEFORE), ("80mm-1024", NOW)),
    ]
    rows = [row(*each) for each in due]
    assert turns.missing(rows[:3], names, [BEFORE, NOW], repeats=2) == due[3:]
    assert not turns.missing(rows, names, [BEFORE, NOW], repeats=2)


def test_rows_of_other_code_or_machines_are_made_anew() -> None:
    versions = [BEFORE, f"{NOW}+"]
    kept = [row("tile", BEFORE), row("256x256", "older")]
    old = [row("tile", "older"), row("tile", f"{NOW}+"), row("tile", BEFORE) | {"machine": {"cpu": "two"}}]
    stale = [whole_run.stale(each, ["tile"], HERE, versions) for each in (*kept, *old)]
    assert stale == [False] * 2 + [True] * 3


def test_seconds_of_a_group_are_added_up_and_worse_results_are_told() -> None:
    before = turns.medians([row("gravel+2", BEFORE), row("brick+2", BEFORE, cpu_s=30.0)], BEFORE)
    now = turns.medians([row("gravel+2", NOW, cpu_s=4.0), row("brick+2", NOW, cpu_s=16.0)], NOW)
    (line,) = turns.beside_aims(before, now).splitlines()[2:]
    assert [cell.strip() for cell in line.split("|")[2:7]] == ["2", "40", "20", "0.5", "0.6"]
    assert line.split("|")[-2].strip() == "no"
    for worse in ({"off_target_percent": 1.1}, {"change_rms_percent": 4.2}):
        now = turns.medians([row("gravel+2", NOW, **worse)], NOW)
        assert turns.beside_aims(before, now).split("|")[-2].strip() == "yes"


def test_growth_counts_the_plates_of_one_pitch() -> None:
    rows = {
        f"{side}mm-{samples}": row("", NOW, cpu_s=5.0 * side**2, touch_cpu_s=4.0 * side**2, peak_mb=side)
        for side, samples in turns.PLATES
    }
    rows["25mm-500"]["cpu_s"] = 1e9
    found = turns.exponents(rows)
    assert found["CPU seconds without touch"] == pytest.approx(1.0)
    assert found["peak MB"] == pytest.approx(0.5)
    assert not turns.exponents({"25mm-320": rows["25mm-320"]})


def test_medians_are_of_a_case_and_a_version() -> None:
    rows = [row("tile", NOW, cpu_s=seconds) for seconds in (3.0, 9.0, 4.0)] + [row("tile", BEFORE)]
    assert turns.medians(rows, NOW)["tile"]["cpu_s"] == 4.0


@pytest.mark.parametrize("path", touch_clock.PROGRESS)
def test_outermost_stages_of_touch_are_counted(tmp_path: Path, path: str) -> None:
    stages = tmp_path / path
    stages.parent.mkdir(parents=True)
    for folder in stages.relative_to(tmp_path).parents[:-1]:
        (tmp_path / folder / "__init__.py").touch()
    stages.write_text((ROOT / "relief" / "ground" / "progress.py").read_text())
    name = path.removesuffix(".py").replace("/", ".")
    (tmp_path / "work.py").write_text(
        f"import sys, time\nfrom {name} import stage\n"
        "def spin():\n    end = time.process_time() + 0.05\n    while time.process_time() < end: pass\n"
        "@stage('pressing')\ndef press():\n    spin()\n"
        "with stage('verifying'):\n    spin()\n"
        "    with stage('pressing on places'):\n        press()\n"
        "press()\nsys.exit(3)\n"
    )
    command = [sys.executable, touch_clock.__file__, "seconds.json", "work"]
    assert subprocess.run(command, cwd=tmp_path, check=False).returncode == 3
    assert 0.1 <= json.loads((tmp_path / "seconds.json").read_text()) < 0.14


def test_stages_of_touch_are_in_the_code() -> None:
    code = "".join(path.read_text() for path in (ROOT / "tactile").rglob("*.py"))
    assert all(f'stage("{name}"' in code for name in touch_clock.TOUCH)


def test_the_command_of_a_version_is_found(tmp_path: Path) -> None:
    assert module_of(ROOT) == "retouch"
    assert module_of(tmp_path) == "optimize"


def test_a_command_has_one_line_with_a_column_for_each_version() -> None:
    rows = [{"command": "a", "version": v, "cpu_s": s, "least": 0.0} for v, s in (("old", 2.0), ("new", 1.0))]
    assert whole_run.by_version(rows) == [{"command": "a", "old": 2.0, "new": 1.0}]
