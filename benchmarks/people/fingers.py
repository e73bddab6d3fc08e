"""How often the finger that answered is found in the table of fingers, on simulated answers.

python -m benchmarks.people.fingers DIR      # the finished set of `benchmarks.surfaces.stimuli`
python -m benchmarks.people.fingers          # the sentence again, from the results

In each of 200 experiments eight people with one finger of every report compare 120 pairs each; JND 19 %, 2 %
lapses, side preferences of 0.3 JND.
"""

from __future__ import annotations

import textwrap
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import load, machine, publish, save, study_given
from retouch.laboratory.people.comparisons import Question
from retouch.laboratory.people.plan import plan
from retouch.laboratory.people.plates import MEASURED, SetPlate, read_plates
from retouch.laboratory.people.reading import ROUGHER, JudgedPair
from retouch.laboratory.people.whose_finger import fingers
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment
from tests.retouch.laboratory.people.observers import Observer, answered

RESULT = "people_fingers"
EXPERIMENTS = 200


def felt_of(folder: Path) -> dict[str, dict[str, float]]:
    """V of the plates of a set by finger and label, from the tables of its runs."""
    each = [plate for plate in read_plates(folder, fingers=True).values() if plate.kind == "roughness"]
    names = [name for name in each[0].by_finger if name != MEASURED]
    return {name: {plate.label: plate.by_finger[name] for plate in each} for name in names}


def plates_of(felt: dict[str, dict[str, float]]) -> dict[str, SetPlate]:
    """The plates as experiments need them, by label."""
    own, *_ = felt.values()
    found = {}
    for label, roughness in own.items():
        texture, level = label.split(" ")
        plate = SetPlate(label, texture, "roughness", float(level), roughness, 30.0, None, Path())
        found[label] = replace(plate, by_finger={name: each[label] for name, each in felt.items()})
    return found


def experiment(number: int, felt: dict[str, dict[str, float]]) -> dict[str, Any]:
    """The finger of eight people who answer a plan of 120 pairs each, and the one that is named first."""
    plates, rng = plates_of(felt), np.random.default_rng(number)
    name = list(felt)[number % len(felt)]
    people = [
        Observer(0.19, lambda plate: felt[name][plate.label], lapses=0.02, preference=preference)
        for preference in (0.3 * rng.standard_normal(8)).tolist()
    ]
    lines = answered(ROUGHER, plan(plates, Experiment(seed=number)), plates, people, rng).decode()
    rows = [line.split(",") for line in lines.splitlines()[1:]]
    pairs = [JudgedPair(row[0], row[2], row[3], row[4]) for row in rows]
    best = fingers(Question.of(ROUGHER, pairs), plates)
    behind = next(one.behind for one in best if one.name == name)
    return {"named": name, "best": best[0].name, "behind_of_named": behind}


def summary(experiments: list[dict[str, Any]]) -> str:
    """How often the finger is found."""
    right = np.mean([one["named"] == one["best"] for one in experiments])
    near = np.mean([one["behind_of_named"] < 3.0 for one in experiments])
    words = (
        f"{len(experiments)} experiments. Where one of the five fingers of every report answered, the table "
        f"named it first in {100.0 * right:.0f} %, and less than 3 behind in {100.0 * near:.0f} %."
    )
    return textwrap.fill(words, 120)


def main() -> None:
    if (folder := study_given(__doc__)) is not None:
        felt = felt_of(folder)
        experiments = [experiment(number, felt) for number in range(EXPERIMENTS)]
        save(RESULT, {"machine": machine(), "felt": felt, "experiments": experiments})
    publish("people", "fingers", summary(load(RESULT)["experiments"]))


if __name__ == "__main__":
    main()
