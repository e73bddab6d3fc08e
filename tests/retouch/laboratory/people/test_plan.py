"""Plans are balanced, random by their seed, and say what each person does."""

from collections import Counter
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from retouch.laboratory.people.plan import APART, TrialPlan, plan, planned, write_plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.reading import COLDER, MAGNITUDES, ROUGHER, SAME, SORTS
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment
from tests.retouch.laboratory.people.conftest import write_plates

TEXTURES = ("gravel", "bark", "knit", "leather")


def planned_for(folder: Path, **changed: Any) -> TrialPlan:
    return plan(read_plates(write_plates(folder, TEXTURES)), Experiment(**changed))


def test_every_pair_comes_equally_often_in_both_orders(tmp_path: Path) -> None:
    shared = planned_for(tmp_path, people=5, pairs=30).trials[ROUGHER]
    counts = Counter(pair for trials in shared.values() for pair in trials)
    # Four textures of ten pairs in two orders.
    assert len(counts) == 80 and max(counts.values()) - min(counts.values()) <= 1
    whole = planned_for(tmp_path, people=2, pairs=170).trials[ROUGHER]
    assert all(set(Counter(trials).values()) == {2} for trials in whole.values())


def test_one_texture_comes_again_after_two_trials(tmp_path: Path) -> None:
    of = planned_for(tmp_path, people=3)
    for question in (ROUGHER, COLDER, SAME, MAGNITUDES):
        for trials in of.trials[question].values():
            textures = [of.textures[places[0]] for places in trials]
            for apart in range(1, APART + 1):
                assert all(one != other for one, other in zip(textures, textures[apart:], strict=False))


def test_one_texture_alone_is_planned_too(tmp_path: Path) -> None:
    of = plan(read_plates(write_plates(tmp_path, ("gravel",))), Experiment(people=1))
    assert len(of.trials[ROUGHER]["P1"]) == 120
    assert any(one != other for one, other in pairwise(of.trials[ROUGHER]["P1"]))


def test_the_seed_decides_the_order(tmp_path: Path) -> None:
    first, again, other = (planned_for(tmp_path, seed=seed) for seed in (3, 3, 4))
    assert first == again and first.digest == again.digest
    assert first.trials != other.trials and first.digest != other.digest


def test_the_tables_hold_the_trials(tmp_path: Path) -> None:
    folder = write_plates(tmp_path)
    of = write_plan(folder, Experiment(people=2, pairs=10))
    assert of is not None
    trials = planned(folder, {})
    assert trials.keys() == of.trials.keys() == {ROUGHER, COLDER, SAME, SORTS, MAGNITUDES}
    assert len(trials[ROUGHER]) == 20 and len(trials[SORTS]) == 4
    text = (folder / "experiment" / "rougher.csv").read_text()
    assert text.splitlines()[0] == "person,trial,first,second,rougher"
    assert all(line.endswith(",") for line in text.splitlines()[1:])


@pytest.mark.parametrize("labels", [2, 27])
def test_sets_too_small_or_too_large_are_not_sorted(labels: int, tmp_path: Path) -> None:
    rows = [f"t,t {n},roughness,{n},{0.02 * 1.1**n},30" for n in range(labels)]
    head = "texture,label,kind,level,roughness,contact_area_mm2"
    (tmp_path / "plates.csv").write_text("\n".join([head, *rows]))
    of = plan(read_plates(tmp_path), Experiment(people=2, pairs=20))
    assert SORTS not in of.trials and len(of.trials[ROUGHER]["P2"]) == 20


def test_plates_that_measure_differently_are_another_set(tmp_path: Path) -> None:
    of = planned_for(tmp_path)
    moved = tuple(replace(plate, folder=tmp_path / "elsewhere") for plate in of.plates)
    assert replace(of, plates=moved).digest == of.digest
    for changed in ({"roughness": 0.05}, {"kind": "control"}, {"level": 3.0}, {"contact_area_mm2": 31.0}):
        assert replace(of, plates=(replace(of.plates[0], **changed), *of.plates[1:])).digest != of.digest
