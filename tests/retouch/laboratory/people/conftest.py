"""A set of plates without runs, its plan, and answers of observers who are known."""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from retouch.laboratory.people.plan import write_plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment
from tests.retouch.laboratory.people.observers import Observer, write_answers

HEADINGS = ["texture", "label", "kind", "level", "roughness", "contact_area_mm2", "picture_change_percent"]
PEOPLE = 3


def write_plates(folder: Path, textures: Sequence[str] = ("gravel", "bark")) -> Path:
    """`plates.csv` of textures at five levels of roughness and two of contact area."""
    rows = []
    for number, texture in enumerate(textures):
        base = 0.04 + 0.01 * number
        rows += [
            [texture, f"{texture} {level:+d}", "roughness", level, base * 1.19**level, 30.0, 1.5 * abs(level)]
            for level in range(-2, 3)
        ]
        rows += [
            [texture, f"{texture} area {ratio:g}", "contact area", ratio, base, 30.0 * ratio, 2.0]
            for ratio in (0.7, 1.4)
        ]
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / "plates.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([HEADINGS, *rows])
    return folder


def observers(count: int = PEOPLE, weber: float = 0.19) -> list[Observer]:
    return [Observer(weber, lambda plate: plate.roughness, lapses=0.02) for _ in range(count)]


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a set with its plan, and `answers/` of three people to every question."""
    folder = write_plates(tmp_path_factory.mktemp("people") / "set")
    plan = write_plan(folder, Experiment(people=PEOPLE, pairs=40))
    assert plan is not None
    write_answers(folder / "answers", plan, read_plates(folder), observers(), seed=1)
    return folder


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)
