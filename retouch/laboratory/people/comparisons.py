"""What answers to pairs say: just-noticeable difference, point of equality, lapses, and which finger fits."""

import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np
from scipy.special import ndtr

from relief.ground.progress import stage
from retouch.laboratory.people.likelihood import PairAnswers
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.population import Estimate, Fitted, fit, weber
from retouch.laboratory.people.reading import COLDER, ROUGHER, JudgedPair
from retouch.laboratory.people.scores import (
    RankCorrelation,
    correlations,
    people_reversed,
    ranked,
    wilson,
)
from retouch.laboratory.people.tables import grouped
from retouch.laboratory.stimulus_sets.prediction import CONTACT_JND
from tactile.jnd import ROUGHNESS_JND

QUANTITIES: dict[str, tuple[str, float]] = {
    ROUGHER: ("roughness", ROUGHNESS_JND),
    COLDER: ("contact_area_mm2", CONTACT_JND),
}
"""For each question the quantity of a plate that answers go by, and its ratio at one JND."""
FEW_ANSWERS = 20
"""Answers of a person below which the JND is known within a factor of about three at best."""
MOST_POINTS = 21
"""Most points of the psychometric function on the page."""


@dataclass(frozen=True)
class Fractions:
    """A just-noticeable difference and what else answers to pairs say, with the ends of 95 % intervals.

    Attributes:
        weber: Weber fraction.
        pse: ratio of the plates' values at which both are named equally often.
        lapse_rate, guess_rate: of answers that go by nothing felt, and half of it.
    """

    weber: float | None
    weber_low: float
    weber_high: float | None
    pse: float | None
    pse_low: float | None
    pse_high: float | None
    lapse_rate: float | None
    lapse_rate_low: float | None
    lapse_rate_high: float | None
    guess_rate: float | None

    @classmethod
    def of(cls, one: Fitted) -> Self:
        """Weber fraction, point of equality and lapse rate of a fit."""
        fraction, noise, lapses = weber(one.noise), one.noise.value, one.lapses
        equality = Estimate(None, None, None)
        if noise is not None:
            equality = one.preference.mapped(lambda jnd: math.exp(jnd * math.exp(noise)))
        return cls(
            fraction.value,
            # A fraction cannot lie below 0; without errors nothing bounds it from below.
            fraction.low or 0.0,
            fraction.high,
            *(equality.value, equality.low, equality.high),
            *(lapses.value, lapses.low, lapses.high),
            None if lapses.value is None else 0.5 * lapses.value,
        )


@dataclass(frozen=True)
class PersonResult:
    """What one person's answers say; `note` is what they cannot say."""

    person: str
    answers: int
    fractions: Fractions
    note: str | None

    def as_json(self) -> dict[str, Any]:
        """The person as `answers.json` has it."""
        return {"person": self.person, "answers": self.answers, **asdict(self.fractions), "note": self.note}


@dataclass(frozen=True)
class Point:
    """A point of the psychometric function: share of answers for the second plate, %, at a difference."""

    jnd: float
    answers: int
    second_percent: float
    low_percent: float
    high_percent: float
    predicted_percent: float


@dataclass(frozen=True)
class Preference:
    """How often a plate was ranked above another one of its texture, %."""

    texture: str
    above: str
    below: str
    answers: int
    told_percent: float
    low_percent: float
    high_percent: float
    predicted_percent: float


@dataclass(frozen=True)
class PairResults:
    """All that the answers to a question about pairs say.

    Attributes:
        answers: their number.
        fractions: of everybody.
        people: each alone.
        told_right_percent, predicted_right_percent: pairs told as predicted, and expected so; None if all
            plates are equal.
        predicted_weber: Weber fraction of the prediction.
        points: of the psychometric function.
        matrix: every two plates of a texture.
        order: rank correlations, by texture.
        left_out: people who answered the other way round; all but `people` is without them.
        notes: what a person should know of the answers, a line each.
    """

    answers: int
    fractions: Fractions
    people: tuple[PersonResult, ...]
    told_right_percent: float | None
    predicted_right_percent: float | None
    predicted_weber: float
    points: tuple[Point, ...]
    matrix: tuple[Preference, ...]
    order: tuple[RankCorrelation, ...]
    left_out: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def rows(self) -> list[tuple[str, int, Fractions, str]]:
        """Name, number of answers, fractions and note of everybody together and of each person."""
        each = [(one.person, one.answers, one.fractions, one.note or "") for one in self.people]
        return [("everybody", self.answers, self.fractions, ""), *each]

    def as_json(self) -> dict[str, Any]:
        """The results as `answers.json` has them."""
        return {
            "answers": self.answers,
            **asdict(self.fractions),
            "people": [one.as_json() for one in self.people],
            "told_right_percent": self.told_right_percent,
            "predicted_right_percent": self.predicted_right_percent,
            "predicted": {"weber": self.predicted_weber, "pse": 1.0},
            "points": [asdict(one) for one in self.points],
            "matrix": [asdict(one) for one in self.matrix],
            "order": [asdict(one) for one in self.order],
            "left_out": list(self.left_out),
        }


@dataclass(frozen=True)
class Question:
    """Answers to one question about pairs, by person.

    Attributes:
        name: rougher or colder.
        people: names, in the order of the answers.
        pairs: of each of them.
    """

    name: str
    people: tuple[str, ...]
    pairs: tuple[tuple[JudgedPair, ...], ...]

    @classmethod
    def of(cls, name: str, pairs: Sequence[JudgedPair]) -> "Question":
        """The answers, by person."""
        by_person = grouped((pair.person, pair) for pair in pairs)
        return cls(name, tuple(by_person), tuple(tuple(each) for each in by_person.values()))

    def without(self, people: Sequence[str]) -> "Question":
        """The answers of all others."""
        return self.of(self.name, [p for p in itertools.chain(*self.pairs) if p.person not in people])

    def answers(self, value: Callable[[str], float]) -> list[PairAnswers]:
        """Answers of each person, with differences by a value of the plates, by label."""
        return [
            PairAnswers(
                np.array([math.log(value(pair.second) / value(pair.first)) for pair in each]),
                np.array([pair.second_told for pair in each]),
            )
            for each in self.pairs
        ]


def compared(question: Question, plates: Mapping[str, SetPlate]) -> PairResults:
    """All that the answers to a question about pairs say.

    Args:
        question: the answers.
        plates: of the set, by label.
    """
    quantity, ratio = QUANTITIES[question.name]
    each = question.answers(lambda label: float(getattr(plates[label], quantity)))
    of_people = dict(zip(question.people, each, strict=True))
    orders = [(pair.person, _ascending(pair)) for pair in itertools.chain(*question.pairs)]
    turned = people_reversed(question.name, orders, plates, quantity)
    question = question.without(turned.left_out)
    answers = [of_people[name] for name in question.people]
    with stage("fitting what people told"):
        everybody = fit(answers)
        fitted = dict(zip(question.people, everybody.each, strict=True))
        fitted |= {name: fit([of_people[name]]).middle for name in turned.left_out}
    notes = {name: _note(fitted[name], len(one)) for name, one in of_people.items()}
    notes |= turned.notes
    scores = ranked((order for person, order in orders if person in question.people), plates)
    right, expected = _told_right(answers, ratio)
    return PairResults(
        answers=sum(map(len, answers)),
        fractions=Fractions.of(everybody.middle),
        people=tuple(
            PersonResult(name, len(one), Fractions.of(fitted[name]), notes[name])
            for name, one in of_people.items()
        ),
        told_right_percent=right,
        predicted_right_percent=expected,
        predicted_weber=ratio - 1.0,
        points=tuple(points(answers, ratio)),
        matrix=tuple(_matrix(question, plates, quantity, ratio)),
        order=correlations(scores, plates, quantity),
        left_out=turned.left_out,
        notes=(
            *turned.lines,
            *_halves_reversed(question.without(tuple(turned.notes)), plates, quantity),
            *scores.notes(question.name),
        ),
    )


def _halves_reversed(question: Question, plates: Mapping[str, SetPlate], quantity: str) -> Iterator[str]:
    """A line for each person who answered one half of the pairs, in their order, the other way round."""
    halves = (
        (f"the {('first', 'second')[2 * k >= len(each)]} half of {pair.person}'s answers", _ascending(pair))
        for each in question.pairs
        for k, pair in enumerate(each)
    )
    for half, note in people_reversed(question.name, halves, plates, quantity).notes.items():
        yield f"{question.name}: {half} {note}; were keys or columns exchanged in between?"


def _ascending(pair: JudgedPair) -> tuple[str, str]:
    """Labels of a pair as told, the higher last."""
    return (pair.first, pair.second) if pair.second_told else (pair.second, pair.first)


def _note(one: Fitted, answers: int) -> str | None:
    """What a person's answers cannot say."""
    if one.noise.value is None and one.noise.high is not None:
        return "no errors that tell a JND: it is at most the upper end"
    if one.noise.high is None:
        return "no better than guessing: the JND is at least the lower end"
    if answers < FEW_ANSWERS:
        return f"fewer than {FEW_ANSWERS} answers"
    return None


def _told_right(answers: Sequence[PairAnswers], ratio: float) -> tuple[float | None, float | None]:
    """Percentage of pairs ranked as predicted, and expected so; equal plates are left out."""
    differences = np.concatenate([one.differences for one in answers])
    second = np.concatenate([one.second for one in answers])
    some = differences != 0.0
    if not some.any():
        return None, None
    expected = ndtr(np.abs(differences[some]) / math.log(ratio))
    right = second[some] == (differences[some] > 0.0)
    return 100.0 * float(right.mean()), 100.0 * float(expected.mean())


def points(answers: Sequence[PairAnswers], ratio: float) -> Iterator[Point]:
    """Share of answers for the second plate over the predicted difference, JND."""
    jnd = np.concatenate([one.differences for one in answers]) / math.log(ratio)
    second = np.concatenate([one.second for one in answers])
    edges = np.unique(np.round(jnd, 1))
    if len(edges) > MOST_POINTS:
        edges = np.unique(np.quantile(jnd, np.linspace(0.0, 1.0, MOST_POINTS)))
    nearest = np.abs(jnd[:, None] - edges).argmin(axis=1)
    for number in range(len(edges)):
        some = nearest == number
        if some.any():
            at = float(jnd[some].mean())
            low, high = wilson(int(second[some].sum()), int(some.sum()))
            share, expected = float(second[some].mean()), float(ndtr(at))
            yield Point(at, int(some.sum()), *(100.0 * each for each in (share, low, high, expected)))


def _matrix(
    question: Question, plates: Mapping[str, SetPlate], quantity: str, ratio: float
) -> list[Preference]:
    """How often each plate ranks above each other of its texture, and should: the paper's figure 25."""
    told = [
        (pair.told, *sorted((pair.first, pair.second), key=lambda label: getattr(plates[label], quantity)))
        for pair in itertools.chain(*question.pairs)
        if plates[pair.first].texture == plates[pair.second].texture
    ]
    rows = []
    for (upper, lower), above in grouped(((high, low), label == high) for label, low, high in told).items():
        jnd = math.log(getattr(plates[upper], quantity) / getattr(plates[lower], quantity)) / math.log(ratio)
        low, high = wilson(sum(above), len(above))
        shares = (100.0 * sum(above) / len(above), 100.0 * low, 100.0 * high, 100.0 * float(ndtr(jnd)))
        rows.append(Preference(plates[upper].texture, upper, lower, len(above), *shares))
    return sorted(rows, key=lambda row: (row.texture, row.above, row.below))
