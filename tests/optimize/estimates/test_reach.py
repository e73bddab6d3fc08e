"""The reach tells where the change of pictures passes 2 % of white, by short descents both ways."""

import json
from pathlib import Path

import numpy as np
import pytest

from optimize.estimates import reach as reaching
from optimize.estimates.change_curves import ChangeCurve, Reach, crossing
from optimize.estimates.reach import reach
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from retouch.commands.main import main
from tactile.quantities import LARGEST_JND, LIMIT_PERCENT
from tactile.skin import Skin
from tests.visual.scenes import PLASTIC, hills, sun, write_scene
from visual.scene import load_scene


@pytest.mark.parametrize(("slope", "bend"), [(0.4, 0.05), (0.05, 0.1), (0.5, 0.0)])
def test_the_curve_through_the_ends_is_found_again(slope: float, bend: float) -> None:
    ends = [(jnd, slope * jnd + bend * jnd**3) for jnd in (2.1, 3.9)]
    at = crossing(ends, True)
    assert slope * at + bend * at**3 == pytest.approx(LIMIT_PERCENT)


def test_a_curve_that_bends_down_goes_on_in_a_line_and_no_reach_exceeds_a_run() -> None:
    assert crossing([(2.0, 1.0), (4.0, 1.6)], True) == pytest.approx(5.0)
    assert crossing([(2.0, 0.4), (4.0, 1.6)], False) == pytest.approx(5.0)
    assert crossing([(2.0, 3.0)], True) == pytest.approx(4.0 / 3.0)
    assert crossing([(2.0, 0.1), (4.0, 0.2)], True) == crossing([(2.0, 0.0)], False) == LARGEST_JND


def test_the_fast_look_takes_the_steps_and_the_change_grows_with_the_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reaching, "CURVE_JND", (0.5, 1.0))
    monkeypatch.setattr(reaching, "STEPS", 3)
    lit = load_scene(write_scene(tmp_path, hills(1.0), [sun(35.0, name="sun")], PLASTIC))
    found = reach(lit, Skin())
    assert (found.touch, found.look) == ("quick", "fast")
    for way in (found.rougher, found.smoother):
        jnds, changes = zip(*way.ends, strict=True)
        assert list(jnds) == sorted(jnds) and list(changes) == sorted(changes)
        assert 0.0 < way.jnd <= LARGEST_JND
        if way.arrived and changes[-1] < LIMIT_PERCENT:
            assert jnds == pytest.approx(reaching.CURVE_JND, abs=0.1)


@pytest.mark.slow
def test_other_scenes_fall_back_to_the_exact_models(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reaching, "CURVE_JND", (0.5,))
    monkeypatch.setattr(reaching, "SAMPLES", 16)
    save_heights_exr(tmp_path / "hills.exr", hills(1.0))
    arguments = [
        "evaluate",
        str(tmp_path / "hills.exr"),
        "--reach",
        "--scene",
        "evening",
        "-D",
        "resolution=16",
    ]
    assert main([*arguments, "--json"]) == 0
    (entry,) = json.loads(capsys.readouterr().out)
    found = entry["reach"]
    assert (found["touch"], found["look"]) == ("layer", "exact")
    assert found["limit_percent_of_white"] == LIMIT_PERCENT
    of_mean = 100.0 * LIMIT_PERCENT / found["mean_percent_of_white"]
    assert found["limit_percent_of_mean"] == pytest.approx(of_mean) and of_mean > LIMIT_PERCENT
    assert found["rougher"]["ends"][0][0] == pytest.approx(0.5, abs=0.1)
    assert 0.0 < found["smoother"]["ends"][0][1] < LIMIT_PERCENT


def test_what_has_no_reach_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    save_heights_exr(tmp_path / "flat.exr", np.full((32, 32), 0.5))
    with pytest.raises(InputError, match="flat"):
        reach(load_scene("studio", {"resolution": "16"}, texture=tmp_path / "flat.exr"), Skin())
    save_heights_exr(tmp_path / "hills.exr", hills(1.0))
    for option in (["--scene", "studio"], ["-D", "spp=4"], ["-m", "scalar_rgb"]):
        assert main(["evaluate", str(tmp_path / "hills.exr"), *option]) == 2
        assert capsys.readouterr().err == f"retouch: {option[0]}: belongs to --reach; nothing else renders\n"


def test_what_a_feel_costs_the_look_passes_the_limit_at_the_reach() -> None:
    bent, straight = ((2.0, 0.5), (4.0, 1.6)), ((2.0, 0.6),)
    rougher = ChangeCurve(crossing(bent, True), True, bent)
    smoother = ChangeCurve(crossing(straight, False), True, straight)
    found = Reach(rougher, smoother, touch="quick", look="fast", mean_percent_of_white=20.0)
    assert found.change_percent(4.0) == pytest.approx(1.6)
    assert found.change_percent(rougher.jnd) == pytest.approx(LIMIT_PERCENT)
    assert found.change_percent(-smoother.jnd) == pytest.approx(LIMIT_PERCENT)
    assert found.change_percent(0.0) == 0.0
