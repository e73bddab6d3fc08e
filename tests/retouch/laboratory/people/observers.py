"""Observers whose just-noticeable differences, lapses and fingers are known, who answer the trials of a plan.

Each feels a plate of value V at log V plus normal noise; a comparison of two plates has the noise s, so that
one plate has s / sqrt(2). Answers come from the noise itself, not from the psychometric function that is
fitted.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from retouch.laboratory.people.plan import TrialPlan
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.reading import COLDER, MAGNITUDES, NO, ROUGHER, SAME, SORTS, YES


@dataclass(frozen=True)
class Observer:
    """A person.

    Attributes:
        weber: fraction of V at which 84 of 100 pairs are ranked correctly.
        cold_weber: the same fraction of contact areas.
        lapses: share of answers that are guesses.
        preference: towards the first plate, JND.
        value: what the finger feels of a plate, of which the logarithm counts.
        same_percent: change of pictures at which a plate passes for the texture in half of the looks.
        exponent: of the magnitudes over the felt value.
    """

    weber: float
    value: Callable[[SetPlate], float]
    cold_weber: float = 0.4
    lapses: float = 0.0
    preference: float = 0.0
    same_percent: float = 8.0
    exponent: float = 0.8

    def second(self, difference: float, weber: float, rng: np.random.Generator) -> bool:
        """Whether the second of two plates, which differ by the logarithm, is ranked above the first."""
        if rng.random() < self.lapses:
            return bool(rng.random() < 0.5)
        noise = math.log1p(weber)
        return bool(difference + noise * rng.standard_normal() > noise * self.preference)

    def sort(self, plates: Sequence[SetPlate], rng: np.random.Generator) -> list[str]:
        """Labels from the smoothest to the roughest plate, each felt once."""
        noise = math.log1p(self.weber) / math.sqrt(2.0)
        felt = {plate.label: math.log(self.value(plate)) + noise * rng.standard_normal() for plate in plates}
        return sorted(felt, key=lambda label: felt[label])

    def same(self, one: SetPlate, other: SetPlate, rng: np.random.Generator) -> bool:
        """Whether two plates look alike: their pictures' change, with noise, is below the limit."""
        change = (one.picture_change_percent or 0.0) + (other.picture_change_percent or 0.0)
        return bool(change * math.exp(rng.standard_normal() / 3.0) < self.same_percent)


def answered(
    question: str,
    plan: TrialPlan,
    plates: Mapping[str, SetPlate],
    observers: Sequence[Observer],
    rng: np.random.Generator,
) -> bytes:
    """The table of a question, answered by observers in the place of the plan's people."""
    rows = list(plan.rows(question))
    people = dict(zip(plan.trials[question], observers, strict=True))
    answers = list(_sorted(rows[1:], plates, people, rng)) if question == SORTS else []
    if question != SORTS:
        for row in rows[1:]:
            of_row = [plates[label] for label in row[2:-1]]
            answers.append([*row[:-1], _answer(question, people[row[0]], of_row, rng)])
    text = io.StringIO()
    csv.writer(text).writerows([rows[0], *answers])
    return text.getvalue().encode()


def _answer(question: str, observer: Observer, plates: Sequence[SetPlate], rng: np.random.Generator) -> str:
    if question == SAME:
        return YES if observer.same(plates[0], plates[1], rng) else NO
    if question == MAGNITUDES:
        noise = 0.15 * rng.standard_normal()
        return (
            f"{10.0 * math.exp(observer.exponent * math.log(observer.value(plates[0]) / 0.05) + noise):.3g}"
        )
    values = {
        ROUGHER: (observer.value, observer.weber),
        COLDER: (lambda plate: plate.contact_area_mm2, observer.cold_weber),
    }
    value, weber = values[question]
    difference = math.log(value(plates[1]) / value(plates[0]))
    return plates[1 if observer.second(difference, weber, rng) else 0].label


def _sorted(
    rows: Sequence[Sequence[str]],
    plates: Mapping[str, SetPlate],
    people: Mapping[str, Observer],
    rng: np.random.Generator,
) -> list[list[str]]:
    trials: dict[tuple[str, ...], list[str]] = {}
    for row in rows:
        trials.setdefault(tuple(row[:3]), []).append(row[-1])
    return [
        [*begin, str(place), label]
        for begin, labels in trials.items()
        for place, label in enumerate(people[begin[0]].sort([plates[one] for one in labels], rng), start=1)
    ]


def write_answers(
    folder: Path, plan: TrialPlan, plates: Mapping[str, SetPlate], observers: Sequence[Observer], seed: int
) -> list[Path]:
    """Answer every question of a plan into files of a folder."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    files = []
    for question in plan.trials:
        files.append(folder / f"answers-{question}.csv")
        files[-1].write_bytes(answered(question, plan, plates, observers, rng))
    return files
