"""A dry run refuses what the run would, tells what the run takes, and writes nothing."""

import json
from pathlib import Path

import numpy as np
import pytest

from optimize.commands.main import main
from optimize.runs.config import load_run
from optimize.runs.forecast import Forecast, expected_steps, forecast
from relief.heightmap import save_heights_exr
from tests.visual.scenes import hills

SMALL = ["-D", "resolution=32", "--dry-run"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    save_heights_exr("hills.exr", hills(1.0))
    save_heights_exr("flat.exr", np.full((32, 32), 0.5))
    return tmp_path


def test_everything_is_told_and_nothing_written(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(folder.iterdir())
    assert main(["optimize", "hills.exr", "--jnd", "2", *SMALL]) == 0
    screen = capsys.readouterr().out
    for text in ("32 x 32 samples", "light-10", "relief 1.00 mm", "finite elements", "about 4 steps", "GiB"):
        assert text in screen
    assert main(["optimize", "hills.exr", "--jnd", "2", "--json", *SMALL]) == 0
    found = json.loads(capsys.readouterr().out)
    assert Forecast.__annotations__.keys() | {"run_dir"} == found.keys()
    assert (found["samples"], found["run_dir"]) == (32, "runs/hills")
    assert 1.0 < found["seconds"] < 60.0 and 0.3 < found["memory_gib"] < 1.0
    assert sorted(folder.iterdir()) == before


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["hills.exr"], "no target"),
        (["hills.exr", "--contact-area-mm2", "200"], "touch.contact_area_mm2"),
        (["flat.exr", "--jnd", "1"], "flat"),
        (["hills.exr", "--jnd", "1", "--set", "touch.force_n=1e6"], "force_n"),
        (["hills.exr", "--jnd", "1", "-m", "scalar_rgb"], "no gradients"),
        (["hills.exr", "--jnd", "1", "-o", "other"], "other: holds an earlier run"),
        (["hills.exr", "--jnd", "1", "-o", "hills.exr/run"], "hills.exr"),
    ],
)
def test_what_the_run_refuses_is_refused(
    folder: Path, arguments: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "other").mkdir()
    (folder / "other" / "file").touch()
    before = sorted(folder.rglob("*"))
    assert main(["optimize", *arguments, *SMALL]) == 2
    printed = capsys.readouterr()
    assert named in printed.err and printed.out == ""
    assert sorted(folder.rglob("*")) == before


def test_larger_and_farther_takes_more(folder: Path) -> None:
    def told(*overrides: str) -> Forecast:
        run = load_run("gravel", [f"texture={folder / 'hills.exr'}", "define.resolution=32", *overrides])
        return forecast(run, folder / "run", None)

    small, far, fine = told("touch.jnd=1"), told("touch.jnd=-5"), told("touch.jnd=1", "define.resolution=64")
    assert far.steps > small.steps and far.seconds > small.seconds
    assert fine.seconds > small.seconds and fine.disk_mib > small.disk_mib
    adam = load_run("gravel", ["descent.method=adam", "descent.steps=70"])
    assert expected_steps(adam) == 70
    assert expected_steps(load_run("gravel", ["descent.method=scaling"])) == 1
    assert expected_steps(load_run("gravel", ["touch.jnd=-9", "descent.steps=20"])) == 20
