"""Answers to a set that was made: its plan, what other fingers feel, and a finger of one's own."""

from pathlib import Path

import numpy as np
import pytest

import retouch
from optimize.settings.skins import load_skin
from retouch.commands.main import BAD_INPUT, main
from retouch.laboratory.people.plan import plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.skin_fit import proposal, tried_fingers
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment, StimulusSet
from tests.retouch.laboratory.people.observers import Observer, write_answers

pytestmark = pytest.mark.slow


def answered(folder: Path) -> Path:
    """A file of three people's answers to which of two plates is rougher."""
    plates = read_plates(folder)
    observers = [Observer(0.19, lambda plate: plate.roughness) for _ in range(3)]
    of = plan(plates, Experiment(people=3, pairs=12))
    return write_answers(folder / "answers", of, plates, observers, seed=2)[0]


def test_a_redrawn_set_has_a_plan(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = retouch.redraw_stimuli(copy, experiment={"people": 3, "pairs": 6, "seed": 5})
    assert made.experiment == copy / "experiment" / "index.html" and made.experiment.is_file()
    assert (copy / "experiment" / "rougher.csv").read_text().count("\n") == 1 + 3 * 6
    assert StimulusSet.read(copy / "set.toml").experiment == Experiment(people=3, pairs=6, seed=5)
    assert main(["stimuli", "--redraw", "-o", str(copy), "--people", "0"]) == BAD_INPUT
    assert "--people" in capsys.readouterr().err


def test_plates_that_were_not_verified_have_no_plan(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are plates all the same."""
    from retouch.verbs import stimulus_plates

    def refuse(*_: object) -> None:
        raise retouch.InputError("plates.csv: row 2: roughness: missing")

    monkeypatch.setattr(stimulus_plates, "write_plan", refuse)
    assert retouch.redraw_stimuli(copy).experiment is None


def test_fingers_are_compared_and_one_is_proposed(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, values in (("STIFFNESS", [0.25, 0.5, 1.0, 2.0]), ("DEPTHS", [0.6, 0.8, 1.0, 1.2])):
        for module in (tried_fingers, proposal):
            monkeypatch.setattr(module, name, np.array(values))
    out = copy / "mine.toml"
    made = retouch.answers(copy, [answered(copy)], skin_out=out)
    assert made.skin_file == out and made.content["best_finger"] in {
        one["name"] for one in made.content["fingers"]
    }
    own = made.content["own_finger"]
    assert load_skin(out).young_modulus_mpa == pytest.approx(own["fitted"][0]["value"], rel=1e-3)
    assert own["held_out"] is None and "fitted and not predicted" in own["summary"]
    assert "fitted, not predicted" in out.read_text()


def test_a_finger_needs_the_reliefs(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = answered(copy)
    for heights in copy.glob("rows/*/heights.exr"):
        heights.unlink()
    assert main(["answers", str(copy), str(file), "--skin-out", str(copy / "mine.toml")]) == BAD_INPUT
    assert "a finger needs the run directories of the set" in capsys.readouterr().err
    assert not (copy / "mine.toml").exists() and not (copy / "answers.json").exists()
