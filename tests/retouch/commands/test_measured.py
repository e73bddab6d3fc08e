"""`evaluate` and `optimize` of what was measured: its unit, its holes, its tilt."""

import json
from pathlib import Path

import numpy as np
import pytest

import retouch
from optimize.runs.preparation import press_original
from optimize.settings.run_file import Run, dump_resolved, load_run, run_from_scene
from relief.corrections import filled, levelled
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import save_heights_png
from retouch.commands.main import main, parse
from retouch.commands.optimize import load
from retouch.verbs.exporting import export


@pytest.fixture
def measured(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Array:
    """Heights (32, 32), mm, about their mean, with a hole and a tilt; `measured.npy` holds them in µm."""
    monkeypatch.chdir(tmp_path)
    y, x = np.mgrid[:32, :32] / 32.0
    heights = 0.02 * np.sin(12.0 * np.pi * x) * np.cos(12.0 * np.pi * y) + 0.3 * x - 0.15
    heights[4, 7] = np.nan
    np.save("measured.npy", 1e3 * heights)
    return heights


OPTIONS = ("--units", "um", "--fill", "--level")


def roughness(capsys: pytest.CaptureFixture[str], *words: str) -> float:
    assert main(["evaluate", *words, "--model", "quick", "--json"]) == 0
    return float(json.loads(capsys.readouterr().out)[0]["roughness"])


def test_evaluate_takes_unit_holes_and_tilt(measured: Array, capsys: pytest.CaptureFixture[str]) -> None:
    level = levelled(filled(measured))
    expected = retouch.evaluate(level, model="quick").roughness
    assert roughness(capsys, "measured.npy", *OPTIONS) == pytest.approx(expected, rel=1e-4)
    python = retouch.evaluate("measured.npy", units="um", fill=True, level=True, model="quick")
    assert python.roughness == pytest.approx(expected, rel=1e-4)
    assert main(["evaluate", "measured.npy", *OPTIONS]) == 0
    told = capsys.readouterr().err
    assert "1 of 1024 samples were not measured (0.0977 %); filled from around" in told
    assert "a tilt of 0.3 mm over the width and" in told and "is tilted" not in told
    lifted = filled(measured) - np.nanmin(measured)
    np.save("lifted.npy", lifted)
    assert main(["evaluate", "lifted.npy", "--model", "quick"]) == 0
    assert "lifted.npy: is tilted by 1.7° (0.3 mm over the width" in capsys.readouterr().err


def test_the_heights_of_a_run_are_never_called_tilted(
    measured: Array, caplog: pytest.LogCaptureFixture
) -> None:
    run = run_from_scene("studio", "measured.npy", ["height_scale=0.001", "fill=true", "touch.jnd=1"])
    lifted = filled(measured) - np.nanmin(measured)
    Path("run").mkdir()
    np.save("run/heights.npy", lifted)
    retouch.evaluate("run/heights.npy", model="quick")
    assert "is tilted" in caplog.text
    caplog.clear()
    Path("run/run.toml").write_text(f"# Retouch\n{dump_resolved(run)}")
    (Path("run") / "checkpoint").mkdir()
    (Path("run") / "checkpoint" / "descent.safetensors").touch()
    retouch.evaluate("run/heights.npy", model="quick")
    assert caplog.text == ""


def test_the_unit_of_a_list_goes_to_every_kind(measured: Array, capsys: pytest.CaptureFixture[str]) -> None:
    """As of the print file alone and of the height map alone."""
    level = levelled(filled(measured))
    np.save("level.npy", 0.1 * level)
    export(np.full((16, 16), 0.2), "plate.stl", size_mm=1.4)
    assert main(["evaluate", "level.npy", "plate.stl", "--units", "cm", "--model", "quick", "--json"]) == 0
    map_, mesh = json.loads(capsys.readouterr().out)
    assert map_["roughness"] == pytest.approx(retouch.evaluate(level, model="quick").roughness, rel=1e-4)
    assert mesh["size_mm"] == pytest.approx(14.0)
    assert main(["evaluate", "plate.stl", "--height-scale", "2"]) == 2
    assert "--height-scale: is for height maps" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (
            "evaluate grey.png --relief-mm 1 --units um",
            "--height-scale: is for files that hold mm, as --units is",
        ),
        ("evaluate measured.npy --units um --height-scale 2", "not allowed with argument"),
        ("optimize measured.npy --jnd 1 --units um --height-scale 2", "not allowed with argument"),
        ("optimize measured.npy --jnd 1 --units ell", "'ell' is none of um, mm, cm, m, in, ft"),
        ("optimize measured.npy --jnd 1 --units um", "--fill of evaluate, optimize and prepare fills them"),
        (
            "evaluate measured.npy --units um --fill",
            "so does: retouch prepare measured.npy -o measured-heights.exr",
        ),
    ],
)
def test_what_does_not_fit_is_refused_in_a_line(
    measured: Array, command: str, line: str, capsys: pytest.CaptureFixture[str]
) -> None:
    save_heights_png("grey.png", np.tile(np.linspace(0.0, 1.0, 32), (32, 1)), None)
    try:
        status = main(command.split())
    except SystemExit as refused:
        status = int(str(refused.code))
    assert status == 2
    assert line in capsys.readouterr().err.splitlines()[-1]


def test_python_refuses_what_the_command_does(measured: Array) -> None:
    save_heights_png("grey.png", np.tile(np.linspace(0.0, 1.0, 32), (32, 1)), None)
    for arguments, line in (
        (("grey.png", {"units": "um", "relief_mm": 1.0}), "height_scale: is for files that hold mm"),
        (("measured.npy", {"units": "um", "height_scale": 2.0}), "units: is another scale than height_scale"),
        (("measured.npy", {"units": "ell"}), "units: ell is not one of um, mm"),
        ((np.full((32, 32), 0.5), {"level": True}), "level: is for files"),
    ):
        with pytest.raises(InputError, match=line):
            retouch.evaluate(arguments[0], **arguments[1])


def loaded(command: str) -> Run:
    return load(parse(command.split()))


def test_a_run_reads_the_same_relief_whenever_it_is_read(
    measured: Array, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    quick = "--jnd 1 --set touch.model=quick --set verify.model=none"
    run = loaded(f"optimize measured.npy --units um --fill --level {quick}")
    assert (run.height_scale, run.fill, run.level) == (0.001, True, True)
    Path("again.toml").write_text(dump_resolved(run))
    again = load_run("again.toml")
    for each in (run, again):
        each.check_texture()
        np.testing.assert_allclose(each.design(10.0).heights, levelled(filled(measured)), atol=1e-9)
    press_original(run, run.design(10.0), (), None)
    assert "is tilted" not in caplog.text
    np.save("lifted.npy", filled(measured) - np.nanmin(measured))
    tilted = loaded(f"optimize lifted.npy {quick}")
    press_original(tilted, tilted.design(10.0), (), None)
    assert "is tilted by 1.7°" in caplog.text
