"""`retouch scan`: a print beside its design, a printer by its coupon, and what is refused in one line."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import retouch
from optimize.settings.run_file import run_from_scene
from relief.heightmap import save_heights_exr
from relief.printers import read_printer
from relief.relief import Relief
from relief.scans.coupon import coupon
from relief.scans.pose import Pose
from retouch.commands.main import BAD_INPUT, main
from tests.relief.scans.conftest import POSE, scan_of, texture
from tests.relief.scans.simulated import Scanner, scanned


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a design and scans of two prints."""
    folder = tmp_path_factory.mktemp("scans")
    design = texture(0)
    save_heights_exr(folder / "design.exr", design.heights, design.width_mm)
    for name, scan in {
        "first": scan_of(design, noise_mm=0.01),
        "second": scan_of(design, replace(POSE, variance_mm2=0.12**2), noise_mm=0.01),
    }.items():
        save_heights_exr(folder / f"{name}.exr", scan.heights, scan.size_mm[1])
    return folder


@pytest.mark.slow
@pytest.mark.sentinel
def test_two_prints_are_laid_on_their_design_and_compared(
    files: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["scan", str(files / "design.exr"), str(files / "first.exr"), "--other", str(files / "second.exr")]
    out = tmp_path / "out"
    few = ["--samples", "4", "-D", "resolution=24", "-q"]
    assert main([*argv, "-o", str(out), *few, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((out / "scan.json").read_text())
    assert told["turned_degrees"] == pytest.approx(np.degrees(POSE.turn), abs=0.1)
    assert told["shifted_mm"] == pytest.approx([POSE.shift_x_mm, POSE.shift_y_mm], abs=0.01)
    assert told["scale"] == pytest.approx(POSE.scale, abs=0.002)
    assert told["blur_um_low"] < 70.0 < told["blur_um_high"]
    assert told["other"]["blur_um"] == pytest.approx(120.0, abs=8.0)
    assert told["jnd_from_design_low"] <= told["jnd_from_design"] <= told["jnd_from_design_high"]
    assert told["roughness"] > 0.0 and told["covered_percent"] > 90.0
    # What the two prints differ by is what each differs from the design by.
    between = told["other"]["jnd_from_design"] - told["jnd_from_design"]
    assert told["jnd_between"] == pytest.approx(between, abs=0.1)
    assert told["compared"]["look"]["change_percent"] > 0.0
    assert {each.name for each in out.iterdir()} == {
        *("scan.html", "scan.json", "comparison.html", "print.exr", "other.exr")
    }
    page = (out / "scan.html").read_text()
    assert "first.exr" in page and "second.exr" in page and "http" not in page.replace("http-equiv", "")
    print_ = Relief.read(out / "print.exr")
    assert print_.width_mm == 8.0 and print_.heights.shape == (64, 64)


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["design.exr", "first.exr", "--size-mm", "8000"], "--size-mm: 8000.0 is not a number"),
        (["design.exr", "first.exr", "--size-mm", "223"], "State --units or --size-mm"),
        (["design.exr", "first.exr", "--units", "in"], "state --height-scale or --units"),
        (["design.exr", "none.exr"], "none.exr: no such file"),
        (["design.exr"], "RUN and FILE are needed"),
        (["design.exr", "first.exr", "--layer-um", "50"], "--layer-um: is for coupons"),
        (["first.exr", "--coupon", "design.exr", "-o", "mine.toml"], "one file too many"),
        (["--coupon", "first.exr"], "-o: missing"),
        (["--coupon", "first.exr", "-o", "mine.txt"], "a printer file ends in .toml"),
        (["--coupon", "first.exr", "-o", "mine.toml", "--printer", "mine"], "nor a printer file"),
    ],
)
def test_bad_input_is_refused_in_one_line(
    files: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    line: str,
) -> None:
    monkeypatch.chdir(files)
    assert main(["scan", *arguments]) == BAD_INPUT
    told = capsys.readouterr().err.strip().splitlines()[-1]
    assert told.startswith("retouch: ") and line in told
    assert not (files / "scans").exists() and not (files / "mine.toml").exists()


@pytest.mark.slow
def test_a_coupon_is_written_and_read_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", "--coupon", "-o", "coupon.png", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["size_mm"] == 24.0
    pose = Pose(turn=0.1, variance_mm2=0.04**2, level_mm=1.0)
    scan = scanned(coupon(), pose, Scanner(0.06, noise_mm=0.002), np.random.default_rng(0))
    save_heights_exr("scan.exr", scan.heights, scan.size_mm[1])
    argv = ["scan", "--coupon", "scan.exr", "-o", "mine.toml"]
    assert main([*argv, "--layer-um", "20", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    # A blur of 40 um is that of a pixel of 139 um.
    assert told["measured"]["pixel_um_low"] < 138.6 < told["measured"]["pixel_um_high"]
    assert told["layer_um"] == 20.0 and told["grating_kept"]["1600"] > 0.9

    run = run_from_scene("studio", "gravel", overrides=['print.printer="mine.toml"', "touch.jnd=1"])
    assert run.print.described == read_printer("mine.toml")
    told_again = retouch.export("gravel", "gravel.png", printer="mine.toml")
    assert told_again.printer is not None and told_again.printer.name == "mine"


@pytest.mark.parametrize("others", [["gravel"], ["--size-mm", "10"], ["--base-mm", "1"], ["--repeat", "2x1"]])
def test_a_coupon_has_its_own_lengths(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], others: list[str]
) -> None:
    assert main(["export", "--coupon", *others, "-o", str(tmp_path / "coupon.stl")]) == BAD_INPUT
    assert "--coupon has its own size" in capsys.readouterr().err
    assert not (tmp_path / "coupon.stl").exists()
