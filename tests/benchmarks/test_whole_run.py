"""Whole runs: their settings and textures, and what their rows say."""

from pathlib import Path

import pytest

from benchmarks import whole_run
from benchmarks.shared.common import load
from optimize.settings.run_file import load_run
from relief.relief import Relief


@pytest.mark.parametrize("name", whole_run.CASES)
def test_the_settings_of_a_case_are_sound(name: str) -> None:
    options = whole_run.CASES[name].options
    settings = [options[place + 1] for place, option in enumerate(options) if option == "--set"]
    assert load_run(options[0], (*settings, *whole_run.SHORT)).descent.steps == 1


def test_textures_of_cases_have_their_samples(tmp_path: Path) -> None:
    for case in (whole_run.CASES["256x256"], whole_run.CASES["25mm-500"]):
        relief = Relief.read(Path(whole_run.texture_of(case, tmp_path)[1]))
        assert (relief.surface.width_mm, *relief.heights.shape) == (case.size_mm, *[case.samples] * 2)
    assert whole_run.texture_of(whole_run.CASES["tile"], tmp_path) == ()


def test_a_line_has_the_median_of_its_runs_and_the_largest_miss() -> None:
    rows = load(whole_run.RESULT)["runs"]
    assert rows.keys() == whole_run.CASES.keys()
    demos = [name for name, case in whole_run.CASES.items() if case.group == "demo runs, exact"]
    assert len(demos) == 6
    for number, name in enumerate(demos):
        rows[name] |= {"cpu_s": 10.0 * number, "off_target_percent": 0.1 * number}
    (line,) = (line for line in whole_run.as_table(rows).splitlines() if "demo runs, exact" in line)
    assert [cell.strip() for cell in line.split("|")][4:7:2] == ["25", "0.5"]
