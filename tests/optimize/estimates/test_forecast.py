"""A dry run refuses what the run would, tells what the run takes, and writes nothing."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from optimize.descent.gauss_newton.windows import MOST_AT_ONCE
from optimize.estimates.forecast import Forecast, _building_seconds, expected_steps, forecast
from optimize.runs.memory import needed_gib
from optimize.settings.run_file import load_run
from relief.heightmap import save_heights_exr
from retouch.commands.main import main
from tactile.elements.finite_elements import finite_element_operator, is_built
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.layer.elastic_layer import is_built as is_layer_built
from tactile.skin import Skin
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
    for text in ("32 x 32 samples", "light-10", "relief 1.00 mm", "finite elements", "about 3 steps", "GiB"):
        assert text in screen
    assert main(["optimize", "hills.exr", "--jnd", "2", "--json", *SMALL]) == 0
    found = json.loads(capsys.readouterr().out)
    assert Forecast.__annotations__.keys() | {"run_dir"} == found.keys()
    assert (found["samples"], found["run_dir"]) == (32, "runs/hills")
    assert 1.0 < found["seconds"] < 60.0 and 0.3 < found["memory_gib"] < 1.0
    assert sorted(folder.iterdir()) == before


def test_views_from_the_side_are_told_apart(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["optimize", "hills.exr", "--jnd", "2", "--scene", "in-hand", *SMALL]) == 0
    assert "are for the views from the side; the scene studio has none" in capsys.readouterr().out
    told = []
    for scene in ("studio", "in-hand"):
        assert main(["optimize", "hills.exr", "--jnd", "2", "--json", "--scene", scene, *SMALL]) == 0
        told.append(json.loads(capsys.readouterr().out))
    above, hand = told
    assert above["from_sides_seconds"] == 0.0 < hand["from_sides_seconds"]
    assert hand["seconds"] == pytest.approx(above["seconds"] + hand["from_sides_seconds"], rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["hills.exr"], "no target"),
        (["hills.exr", "--contact-area-mm2", "200"], "--contact-area-mm2: "),
        (["flat.exr", "--jnd", "1"], "flat"),
        (["hills.exr", "--jnd", "1", "--set", "touch.force_n=1e6"], "force_n"),
        (["hills.exr", "--jnd", "1", "--size-mm", "2"], "smaller than pairs of receptors"),
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


@pytest.mark.slow
def test_larger_and_farther_takes_more(folder: Path) -> None:
    def told(*overrides: str) -> Forecast:
        run = load_run("gravel", [f"texture={folder / 'hills.exr'}", "define.resolution=32", *overrides])
        return forecast(run, folder / "run", None)

    small, far, fine = told("touch.jnd=1"), told("touch.jnd=-5"), told("touch.jnd=1", "define.resolution=64")
    assert far.steps > small.steps and far.seconds > small.seconds
    assert fine.seconds > small.seconds and fine.disk_mib > small.disk_mib
    tile = told("touch.jnd=1", "repeats=true")
    assert (small.places, tile.places) == (1, 16)
    assert tile.seconds > small.seconds and tile.memory_gib > small.memory_gib
    assert ("finger", "lands at 16 places") in list(tile.lines())
    assert told("touch.jnd=1", "repeats=true", "touch.fingers=range").seconds > tile.seconds
    adam = load_run("gravel", ["descent.method=adam", "descent.steps=70"])
    assert expected_steps(adam) == 70
    assert expected_steps(load_run("gravel", ["descent.method=scaling"])) == 1
    assert expected_steps(load_run("gravel", ["touch.jnd=-9", "descent.steps=20"])) == 20


@pytest.mark.slow
def test_what_the_cache_lacks_is_counted(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def building(*overrides: str) -> float:
        return _building_seconds(load_run("gravel", overrides), 10.0)

    monkeypatch.setenv("RETOUCH_CACHE", str(folder / "cache"))
    # The elastic layer and the finite elements.
    assert building() == pytest.approx(0.4 + 3.5)
    assert building("verify.resolution=32") < 1.0 and building("touch.skin=layered") > 10.0
    assert building("verify.model=none") == pytest.approx(0.4)
    # Operators of named round fingers come with Retouch.
    round_finger = (
        "touch.shape=round",
        "touch.young_modulus_mpa=0.1",
        "touch.radius_mm=12",
        "touch.force_n=1",
    )
    assert building(*round_finger) > 10.0 and building(*round_finger, "verify.model=layer") == 0.0
    run = load_run("gravel", [f"texture={folder / 'hills.exr'}", "define.resolution=32"])
    anew = forecast(run, folder / "run", None)
    assert ("", "3.9 s of it build the models of this finger, which are kept for later runs") in anew.lines()
    monkeypatch.setattr("tactile.layer.elastic_layer.is_built", lambda *_: True)
    monkeypatch.setattr("tactile.elements.finite_elements.is_built", lambda *_: True)
    built = forecast(run, folder / "run", None)
    assert built.seconds == pytest.approx(anew.seconds - 3.9) and built.building_seconds == 0.0
    assert not any("of it build" in text for _, text in built.lines())


def test_what_was_built_is_in_the_cache(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RETOUCH_CACHE", str(folder / "cache"))
    skin = Skin(thickness_mm=1.5)
    elastic_layer_operator(skin, 32, 10.0, coarse=8)
    finite_element_operator(skin, 32, 10.0, mesh=8)
    assert is_layer_built(skin, 10.0, 8) and not is_layer_built(skin, 10.0, 16)
    assert is_built(replace(skin, force_n=2.0), 8, 10.0) and not is_built(skin, 16, 10.0)


@pytest.mark.slow
@pytest.mark.parametrize("target", ["touch.jnd=1", "touch.roughness=0.02"])
def test_the_most_steps_are_told(folder: Path, target: str) -> None:
    run = load_run("gravel", [f"texture={folder / 'hills.exr'}", "define.resolution=32", target])
    told = forecast(run, folder / "run", None)
    assert told.most_steps == 100 and told.most_seconds > told.seconds
    assert any("a target that is hard to reach takes up to 100 steps" in text for _, text in told.lines())


def test_a_plate_too_large_for_the_memory_is_refused_before_any_work(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("optimize.runs.memory.machine_gib", lambda: 0.51)
    for extra in ([], ["--dry-run"]):
        arguments = ["hills.exr", "--jnd", "1", "--repeats", *SMALL[:2], *extra]
        assert main(["optimize", *arguments]) == 2
        line = capsys.readouterr().err
        assert line.count("\n") == 1 and "hills.exr: 32 x 32 samples touched at 16 places take" in line
    assert not (folder / "runs").exists()


def test_memory_grows_with_samples_and_places() -> None:
    alone, many = needed_gib(500**2, 1), needed_gib(500**2, 49)
    assert alone == pytest.approx(4.25)
    assert many - alone == pytest.approx(8 * 49 * 500**2 / 2**30)


def test_places_of_a_large_surface_take_no_more_than_their_window() -> None:
    side = 2048
    assert side**2 > MOST_AT_ONCE
    alone, many = needed_gib(side**2, 1), needed_gib(side**2, 841)
    assert many - alone == pytest.approx(8 * 841 * 448**2 / 2**30)


def test_a_range_of_fingers_needs_one_factorisation(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("optimize.runs.preparation.MOST_AT_ONCE", 1000)
    assert main(["optimize", "hills.exr", "--jnd", "1", "--set", "touch.fingers=range", *SMALL[:2]]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "touch.fingers=range: 32 x 32 samples are more than" in line
