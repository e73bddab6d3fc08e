"""Of surfaces smoother than people have judged, V, % and waves of the skin are shown, and never a JND."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import retouch
from optimize.run_directory.finished_run import read_verification
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from retouch.commands.main import BAD_INPUT, main
from retouch.commands.summary import summary
from tactile.jnd import SMOOTH_BELOW

SMALL = ("verify.model=layer", "verify.samples=4", "touch.model=layer", "look.model=fast")
PRAISE = re.compile(r"\d(</?\w+>)* JND|of 100 tries|\d just-noticeable differences (rougher|smoother)")
"""A number of just-noticeable differences, or what it decides."""


def waves(height_mm: float) -> np.ndarray:
    """Hills about 2 mm apart on 10 mm, from 0 to a height."""
    at = np.sin(10.0 * np.pi * (np.arange(32) + 0.5) / 32)
    return 0.5 * height_mm * (1.0 + np.outer(at, at))


@pytest.fixture(autouse=True)
def _reliefs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty working directory: reliefs of 0.25 and 0.35 um, of 0.035 and of 0.4 mm."""
    monkeypatch.chdir(tmp_path)
    heights = {"tiny": 2.5e-4, "other": 3.5e-4, "low": 0.035, "high": 0.4}
    for name, height_mm in heights.items():
        save_heights_exr(f"{name}.exr", waves(height_mm), 10.0)


def printed(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """What a command prints, with single spaces."""
    assert main([*argv]) == 0
    return " ".join(capsys.readouterr().out.split())


def test_the_reliefs_lie_on_both_sides_of_the_floor() -> None:
    felt = {name: retouch.evaluate(f"{name}.exr").roughness for name in ("tiny", "low", "high")}
    assert felt["tiny"] < 0.01 * SMOOTH_BELOW
    assert SMOOTH_BELOW < felt["low"] < 1.19**2 * SMOOTH_BELOW < felt["high"]


def test_evaluated_beside_another_texture_a_smooth_one_has_no_jnd(capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(capsys, "evaluate", "tiny.exr", "high.exr", "other.exr")
    assert not PRAISE.search(text)
    assert "tiny.exr: smooth: V 0.00004 is below 0.004, the least that people have judged" in text
    entries = json.loads(printed(capsys, "evaluate", "tiny.exr", "high.exr", "other.exr", "--json"))
    assert [one["jnd_from_first"] for one in entries] == [None] * 3
    both = json.loads(printed(capsys, "evaluate", "low.exr", "high.exr", "--json"))
    assert both[1]["jnd_from_first"] > 5.0


@pytest.mark.slow
@pytest.mark.sentinel
def test_compared_smooth_reliefs_have_bands_and_no_jnd(capsys: pytest.CaptureFixture[str]) -> None:
    few = ("-D", "resolution=32", "--samples", "4", "-o", "page.html")
    text = printed(capsys, "compare", "tiny.exr", "other.exr", *few)
    assert not PRAISE.search(text) and not PRAISE.search(Path("page.html").read_text())
    assert "feel smooth: V 0.00004 is below 0.004" in text and "V changes by +40 %" in text
    assert "skin's surface waves of" in text and "At the surface of the skin" in Path("page.html").read_text()
    found = json.loads(printed(capsys, "compare", "tiny.exr", "other.exr", *few, "--json", "-q"))
    assert found["jnd_apart"] is None and found["told_apart_probability"] is None
    assert found["measured"]["jnd_mean"] is None and found["fingers"]["jnd_mean"] is None
    assert {one["jnd"] for one in found["fingers"]["each"]} == {None}
    assert len(found["surface_bands"]) > 3


@pytest.mark.slow
@pytest.mark.sentinel
def test_jnd_from_a_smooth_original_is_refused_and_the_other_ways_are_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    small = [part for one in SMALL for part in ("--set", one)]
    assert main(["optimize", "tiny.exr", "--jnd", "2", *small, "-o", "run", "-q"]) == BAD_INPUT
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith("retouch: ") and not Path("run").exists()
    assert "--jnd: smooth: V 0.00004 is below 0.004" in line
    assert "--roughness" in line and "--feel-of" in line and "--reach" not in line
    np.save("mask.npy", np.ones((8, 8)))
    for goal in ("touch.jnd=-1", 'touch.region=[{mask="mask.npy", jnd=2.0}]'):
        with pytest.raises(InputError, match=r"smooth: V .* touch\.roughness or touch\.feel_of"):
            retouch.optimize(run_from_scene("studio", "tiny.exr", [*SMALL, goal]), Path("run"))
    assert main(["evaluate", "tiny.exr", "--reach"]) == BAD_INPUT
    assert "smooth: V 0.00004 is below 0.004" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.sentinel
@pytest.mark.parametrize(
    ("texture", "goal", "target"),
    [
        ("tiny", "touch.roughness=0.0001", 1e-4),
        ("tiny", 'touch.feel_of="low.exr"', None),
        ("low", "touch.jnd=-2", None),
    ],
)
def test_a_run_from_or_to_a_smooth_surface_meets_its_roughness_without_a_jnd(
    texture: str, goal: str, target: float | None
) -> None:
    retouch.optimize(run_from_scene("studio", f"{texture}.exr", [*SMALL, goal]), Path("run"), quiet=True)
    result = read_verification(Path("run"))
    assert result is not None and result.outer.miss_percent is not None
    touch = result.touch
    before, after = touch.ends_of("roughness")
    assert min(before, after) < SMOOTH_BELOW and not math.isclose(before, after, rel_tol=0.1)
    assert result.outer.miss_percent < 5.0
    assert target is None or after == pytest.approx(target, rel=0.05)
    assert touch.jnd_from_original is None and touch.places is not None
    assert touch.places.jnd_mean is None
    assert after >= SMOOTH_BELOW or touch.places.farthest_from_target_jnd is None
    assert touch.measured is not None and touch.measured.jnd_mean is None
    words = [sentence for _, sentence in summary(result, Path("run"))]
    assert not PRAISE.search(" ".join(words))
    assert any(f"is below {SMOOTH_BELOW:g}, the least that people have judged" in cell for cell in words)
    assert any(cell.startswith("waves of ") for cell in words)
    report = (Path("run") / "report.html").read_text()
    assert not PRAISE.search(report) and "the least that people have judged; V" in report


@pytest.mark.slow
@pytest.mark.sentinel
def test_the_reach_toward_smoother_ends_where_jnds_do(capsys: pytest.CaptureFixture[str]) -> None:
    (found,) = json.loads(printed(capsys, "evaluate", "low.exr", "--reach", "--json"))
    room = math.log(found["roughness"] / SMOOTH_BELOW) / math.log(1.19)
    assert 0.0 < found["reach"]["smoother"]["jnd"] <= room + 0.2
