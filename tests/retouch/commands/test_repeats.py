"""Tiles by command: felt at many places, run, resumed and compared; refused where the sides do not fit."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import retouch
from mitsuba_scenes import find_file
from optimize.descent.driver import Iterate
from optimize.runs.recorder import Recorder
from optimize.settings.run_file import Run, dump_resolved, load_run, run_from_scene
from optimize.verification.verification import Verification
from relief.heightmap import load_heights, save_heights_exr
from relief.relief import Relief
from relief.surface import axes
from retouch.commands.main import BAD_INPUT, main
from retouch.commands.summary import summary
from retouch.verbs import runs
from retouch.verbs.subjects import read_subjects
from tactile.jnd import jnd_apart

SMALL = ("-D", "resolution=32")
QUICK = ("--fast", "--set", "verify.model=layer", "--set", "verify.samples=16", "--no-baseline", "-q")


def hills() -> np.ndarray:
    """32 x 32 samples of a tile, hills 5 and 3.3 mm apart."""
    y, x = np.meshgrid(*[2.0 * np.pi * np.arange(32) / 32] * 2, indexing="ij")
    waves = np.sin(2.0 * x + y) + 0.6 * np.cos(3.0 * y - x)
    return np.asarray(0.25 * (waves - waves.min()))


@pytest.fixture(autouse=True)
def _reliefs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr("tile.exr", hills(), 10.0)
    save_heights_exr("slope.exr", np.linspace(0.0, 1.0, 32)[None, :] * np.ones((32, 1)), 10.0)


def printed(capsys: pytest.CaptureFixture[str], *argv: str) -> Any:
    assert main([*argv, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_tile_is_evaluated_at_all_its_places(capsys: pytest.CaptureFixture[str]) -> None:
    (alone,) = printed(capsys, "evaluate", "tile.exr")
    (entry,) = printed(capsys, "evaluate", "tile.exr", "--repeats")
    assert "places" not in alone and entry["places"]["count"] == 16
    places = entry["places"]
    assert places["roughness_min"] < entry["roughness"] < places["roughness_max"]
    assert places["roughness_min"] <= alone["roughness"] <= places["roughness_max"]
    (strip,) = printed(capsys, "evaluate", "tile.exr", "--repeats-along", "x")
    assert strip["places"]["count"] == 4
    assert main(["evaluate", "tile.exr", "--repeats"]) == 0
    assert "16 places" in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["evaluate", "optimize"])
def test_sides_that_do_not_fit_are_refused(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    goal = ["--jnd", "1"] if verb == "optimize" else []
    assert main([verb, "slope.exr", "--repeats-along", "x", *goal]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "slope.exr: --repeats-along: " in line and "retouch prepare" in line
    assert not Path("runs").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("options", "repeats"), [((), False), (("--repeats",), True)])
def test_the_run_file_says_whether_it_repeats(
    options: tuple[str, ...], repeats: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    """And so do the height maps of the result, which `evaluate` and `export` read."""
    assert main(["optimize", "tile.exr", "--jnd", "1", *options, *SMALL, *QUICK, "-o", "run"]) == 0
    assert load_run("run/run.toml").repeats is repeats
    places = json.loads(Path("run/result.json").read_text())["touch"]["places"]
    assert places["count"] == (32 if repeats else 1) and ("between" in places) is repeats
    retouch.export("run", "copy.png")
    for file in ("run/heights.exr", "run/heights.png", "copy.png"):
        assert Relief.read(file).repeats == (repeats, repeats)
    capsys.readouterr()
    assert main(["evaluate", "run/heights.exr"]) == 0
    assert ("heights.exr repeats along x and y (its header)" in capsys.readouterr().err) is repeats


def test_a_run_takes_the_header_where_nobody_says_anything(capsys: pytest.CaptureFixture[str]) -> None:
    save_heights_exr("marked.exr", hills(), 10.0, repeats=True)
    Path("plain.toml").write_text('scene = "studio"\ntexture = "marked.exr"\n[touch]\njnd = 1\n')
    Path("plate.toml").write_text("repeats = false\n" + Path("plain.toml").read_text())
    loaded = {name: load_run(f"{name}.toml") for name in ("plain", "plate")}
    assert [run.repeats for run in loaded.values()] == [True, False]
    assert load_run("plain.toml", ["repeats=x"]).repeats == "x"
    made = {"scene": find_file("studio", ".xml"), "texture": Path("marked.exr"), "touch": {"jnd": 1.0}}
    assert Run.model_validate(made).repeats is True and Run.model_validate(made).axes_repeat == (True, True)
    assert load_run("plain.toml", ["texture=tile.exr"]).repeats is False
    # A run file as it is written says it, so that a run goes on as it began.
    Path("dumped.toml").write_text(dump_resolved(loaded["plain"]))
    save_heights_exr("marked.exr", hills(), 10.0)
    assert load_run("dumped.toml").repeats is True and load_run("plain.toml").repeats is False
    for options, places in (((), 16), (("--no-repeats",), None), (("--repeats-along", "x"), 4)):
        save_heights_exr("marked.exr", hills(), 10.0, repeats=True)
        assert main(["evaluate", "marked.exr", "--json", *options]) == 0
        out, err = capsys.readouterr()
        assert json.loads(out)[0].get("places", {}).get("count") == places
        assert ("marked.exr repeats along x and y (its header)" in err) is (not options)


@pytest.mark.parametrize(
    ("pair", "stated", "ends"),
    [
        (("marked.exr", "marked.exr"), None, (True, True)),
        (("marked.exr", "tile.exr"), None, (False, False)),
        (("marked.exr", "tile.exr"), True, (True, True)),
        (("marked.exr", "marked.exr"), False, (False, False)),
    ],
)
def test_two_files_are_compared_as_tiles_if_both_are(
    pair: tuple[str, str], stated: bool | None, ends: tuple[bool, bool]
) -> None:
    save_heights_exr("marked.exr", hills(), 10.0, repeats=True)
    assert [one.relief.repeats for one in read_subjects(*pair, repeats=stated)] == [ends, ends]


@pytest.mark.slow
def test_the_screen_tells_the_places_and_names_one_that_missed(capsys: pytest.CaptureFixture[str]) -> None:
    loud = [word for word in QUICK if word != "-q"]
    assert main(["optimize", "tile.exr", "--jnd", "1", "--repeats", *SMALL, *loud, "-o", "run"]) == 0
    screen = capsys.readouterr().out
    assert "JND over 32 places of the finger" in screen and "farthest" not in screen
    result = json.loads(Path("run/result.json").read_text())
    steered = result["touch"]["places"]["steered"]
    steered["verified_roughness"][6] = 0.9 * steered["target_roughness"][6]
    told = [text for name, text in summary(Verification.from_json(result), Path("run")) if name == "farthest"]
    assert len(told) == 1
    down, right = steered["centres_mm"][6]
    assert f"{right:.1f} mm from the left and {down:.1f} mm from the top" in told[0]


def test_axes_are_rows_and_columns() -> None:
    assert [axes(way) for way in (None, False, True, "x", "y")] == [
        *[(False, False)] * 2,
        *((True, True), (False, True), (True, False)),
    ]


@pytest.mark.slow
def test_a_run_of_many_touches_that_is_cut_off_goes_on_to_the_same_relief(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    overrides = ["touch.jnd=2", "touch.spacing_mm=5", "repeats=true", "define.resolution=32"]
    overrides += ['touch.model="quick"', 'look.model="auto"', 'verify.model="layer"', "verify.samples=16"]
    settings = run_from_scene("studio", "tile.exr", overrides)
    whole = runs.optimize(settings, "whole")
    step = Recorder.step

    def cut(self: Recorder, current: Iterate, best: Iterate, seconds: float) -> None:
        step(self, current, best, seconds)
        raise MemoryError

    with monkeypatch.context() as patch:
        patch.setattr(Recorder, "step", cut)
        with pytest.raises(MemoryError):
            runs.optimize(settings, "cut")
    resumed = runs.resume("cut")
    np.testing.assert_array_equal(resumed.heights, whole.heights)
    touch = resumed.summary["touch"]
    assert touch["places"]["steered"]["count"] == touch["places"]["between"]["count"] == 4
    assert touch["places"]["steered"]["jnd_mean"] == pytest.approx(2.0, abs=0.1)
    assert touch["verified_roughness"] == pytest.approx(
        np.mean(touch["places"]["steered"]["verified_roughness"])
    )
    assert touch["jnd_from_original"] == pytest.approx(
        jnd_apart(touch["verified_roughness"], touch["initial_roughness"])
    )


@pytest.mark.slow
def test_a_run_is_compared_as_the_tile_that_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["optimize", "tile.exr", "--jnd", "1", "--repeats", *SMALL, *QUICK, "-o", "run"]) == 0
    found = printed(capsys, "compare", "run", "-q", "--samples", "4")
    assert found["places"]["count"] == 16
    assert found["places"]["jnd_mean"] == pytest.approx(1.0, abs=0.1)
    assert load_heights("run/heights.exr").shape == (32, 32)


def test_sizes_on_the_screen_are_those_of_the_plate_and_of_the_finger(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """An oblong plate has two sides, and the force of the finger acts on its own patch."""
    save_heights_exr("strip.exr", np.tile(hills(), (1, 2))[:16], 20.0)
    assert main(["export", "strip.exr", "-o", "strip.stl"]) == 0
    assert "strip.stl: 20 x 5 x " in capsys.readouterr().out
    assert main(["evaluate", "strip.exr"]) == 0
    assert "10 N on 5 x 5 mm." in " ".join(capsys.readouterr().out.split())
    assert main(["evaluate", "tile.exr", "--repeats"]) == 0
    assert "10 N on 10 x 10 mm." in " ".join(capsys.readouterr().out.split())
