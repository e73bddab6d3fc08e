"""Answers to a set that was made: its plan, and what other fingers feel."""

import re
from pathlib import Path

import pytest

import retouch
from retouch.commands.main import BAD_INPUT, main
from retouch.laboratory.people.plan import plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment, StimulusSet
from tests.retouch.laboratory.people.observers import Observer, write_answers

pytestmark = pytest.mark.slow


def answered(folder: Path) -> Path:
    """A file of three people's answers to which of two plates is rougher."""
    plates = read_plates(folder)
    observers = [Observer(0.19, lambda plate: plate.roughness) for _ in range(3)]
    of = plan(plates, Experiment(people=3, pairs=12))
    shown = dict(zip(of.labels, plates.values(), strict=True))
    return write_answers(folder / "answers", of, shown, observers, seed=2)[0]


def test_a_redrawn_set_has_a_plan(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = retouch.redraw_stimuli(copy, experiment={"people": 3, "pairs": 6, "seed": 5})
    assert made.experiment == copy / "experiment" / "index.html" and made.experiment.is_file()
    assert (copy / "experiment" / "rougher.csv").read_text().count("\n") == 1 + 3 * 6
    assert StimulusSet.read(copy / "set.toml").experiment == Experiment(people=3, pairs=6, seed=5)
    assert main(["stimuli", "--redraw", "-o", str(copy), "--people", "0"]) == BAD_INPUT
    assert "--people" in capsys.readouterr().err


def test_a_plan_with_answers_is_not_replaced(copy: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Answers name trials of the plan, and another plan would refuse them."""
    retouch.redraw_stimuli(copy, experiment={"people": 3, "pairs": 6, "seed": 5})
    answers = copy / "experiment" / "answers-1-0123abcd" / "answers-rougher.csv"
    answers.parent.mkdir()
    answers.write_text("person,trial,first,second,rougher\n")
    before = (copy / "experiment" / "rougher.csv").read_bytes()
    assert main(["stimuli", "--redraw", "-o", str(copy), "--people", "4"]) == BAD_INPUT
    assert "answers to the plan that is there" in capsys.readouterr().err
    retouch.redraw_stimuli(copy, plates={"label": "none"})
    assert (copy / "experiment" / "rougher.csv").read_bytes() == before


def test_the_number_of_pairs_is_said_where_it_is_another(
    copy: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["stimuli", "--redraw", "-o", str(copy), "--people", "3", "--pairs", "7"]) == 0
    assert "6 pairs each instead of 7" in capsys.readouterr().err


def test_plates_that_were_not_verified_have_no_plan(copy: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They are plates all the same."""
    from retouch.verbs import stimulus_plates

    def refuse(*_: object) -> None:
        raise retouch.InputError("plates.csv: row 2: roughness: missing")

    monkeypatch.setattr(stimulus_plates, "write_plan", refuse)
    assert retouch.redraw_stimuli(copy).experiment is None


def test_codes_stand_for_the_names(copy: Path) -> None:
    """On the page, in the plan and in answers; the analysis has the names again."""
    experiment = ("--people", "3", "--pairs", "12", "--seed", "0")
    assert main(["stimuli", "--redraw", "-o", str(copy), "--codes", *experiment, "-q"]) == 0
    plates = read_plates(copy)
    codes = {plate.code for plate in plates.values()}
    assert len(codes) == len(plates) and all(re.fullmatch("[A-Z]{4}", code) for code in codes)
    file = answered(copy)
    texts = [(copy / "experiment" / name).read_text() for name in ("index.html", "rougher.csv")]
    assert all(code in texts[0] for code in codes)
    for text in texts:
        assert any(code in text for code in codes) and not any(label in text for label in plates)
    found = retouch.answers(copy, [file]).content["rougher"]
    assert {row["above"] for row in found["matrix"]} <= set(plates)


def test_fingers_are_compared(copy: Path) -> None:
    made = retouch.answers(copy, [answered(copy)])
    assert made.page == copy / "answers.html" and made.page.is_file()
    assert made.content["best_finger"] in {one["name"] for one in made.content["fingers"]}
