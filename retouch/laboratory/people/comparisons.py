"""What answers to pairs say: just-noticeable difference, point of equality, lapses, and which finger fits."""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats
from scipy.special import ndtr

from relief.ground.progress import stage
from retouch.laboratory.people.likelihood import PairAnswers
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.population import Estimate, Fitted, fit, weber
from retouch.laboratory.people.reading import COLDER, ROUGHER, Pair
from retouch.laboratory.stimulus_sets.prediction import CONTACT_JND
from tactile.jnd import ROUGHNESS_JND

Entry = dict[str, Any]

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
class Question:
    """Answers to one question about pairs, by person.

    Attributes:
        name: rougher or colder.
        people: names, in the order of the answers.
        pairs: of each of them.
    """

    name: str
    people: tuple[str, ...]
    pairs: tuple[tuple[Pair, ...], ...]

    @classmethod
    def of(cls, name: str, pairs: Sequence[Pair]) -> "Question":
        """The answers, by person."""
        by_person: dict[str, list[Pair]] = {}
        for pair in pairs:
            by_person.setdefault(pair.person, []).append(pair)
        return cls(name, tuple(by_person), tuple(tuple(each) for each in by_person.values()))

    def answers(self, value: Callable[[str], float]) -> list[PairAnswers]:
        """Answers of each person, with differences by a value of the plates, by label."""
        return [
            PairAnswers(
                np.array([math.log(value(pair.second) / value(pair.first)) for pair in each]),
                np.array([pair.second_told for pair in each]),
            )
            for each in self.pairs
        ]


def compared(question: Question, plates: Mapping[str, SetPlate]) -> Entry:
    """All that the answers to a question about pairs say, as `answers.json` has it.

    Args:
        question: the answers.
        plates: of the set, by label.
    """
    quantity, ratio = QUANTITIES[question.name]
    answers = question.answers(lambda label: float(getattr(plates[label], quantity)))
    with stage("fitting what people told"):
        fitted = fit(answers)
    entry: Entry = {"answers": sum(map(len, answers))} | fractions(fitted.middle)
    entry["people"] = [
        {"person": name, "answers": len(each)} | fractions(one) | {"note": _note(one, len(each))}
        for name, each, one in zip(question.people, answers, fitted.each, strict=True)
    ]
    entry |= _told_right(answers, ratio)
    entry["predicted"] = {"weber": ratio - 1.0, "pse": 1.0}
    entry["points"] = points(answers, ratio)
    entry["matrix"] = _matrix(question, plates, quantity, ratio)
    entry["order"] = order(question, plates, quantity)
    return entry


def fractions(one: Fitted) -> Entry:
    """Weber fraction, point of equality and lapse rate with their intervals."""
    fraction = weber(one.noise)
    noise = one.noise.value
    equality = Estimate(None, None, None)
    if noise is not None:
        equality = one.preference.mapped(lambda jnd: math.exp(jnd * math.exp(noise)))
    return {
        "weber": fraction.value,
        # A fraction cannot lie below 0; without errors nothing bounds it from below.
        "weber_low": fraction.low or 0.0,
        "weber_high": fraction.high,
        **_ends("pse", equality),
        **_ends("lapse_rate", one.lapses),
        "guess_rate": None if one.lapses.value is None else 0.5 * one.lapses.value,
    }


def _ends(name: str, estimate: Estimate) -> Entry:
    return {name: estimate.value, f"{name}_low": estimate.low, f"{name}_high": estimate.high}


def _note(one: Fitted, answers: int) -> str | None:
    """What a person's answers cannot say."""
    if one.noise.value is None and one.noise.high is not None:
        return "no errors that tell a JND: it is at most the upper end"
    if one.noise.high is None:
        return "no better than guessing: the JND is at least the lower end"
    if answers < FEW_ANSWERS:
        return f"fewer than {FEW_ANSWERS} answers"
    return None


def _told_right(answers: Sequence[PairAnswers], ratio: float) -> Entry:
    """How many pairs are told as the prediction has them, and how many it expects; equal plates left out."""
    differences = np.concatenate([one.differences for one in answers])
    second = np.concatenate([one.second for one in answers])
    some = differences != 0.0
    expected = ndtr(np.abs(differences[some]) / math.log(ratio))
    right = second[some] == (differences[some] > 0.0)
    return {
        "told_right_percent": 100.0 * float(right.mean()) if some.any() else None,
        "predicted_right_percent": 100.0 * float(expected.mean()) if some.any() else None,
    }


def points(answers: Sequence[PairAnswers], ratio: float) -> list[Entry]:
    """Share of answers for the second plate over the predicted difference, JND."""
    jnd = np.concatenate([one.differences for one in answers]) / math.log(ratio)
    second = np.concatenate([one.second for one in answers])
    edges = np.unique(np.round(jnd, 1))
    if len(edges) > MOST_POINTS:
        edges = np.unique(np.quantile(jnd, np.linspace(0.0, 1.0, MOST_POINTS)))
    nearest = np.abs(jnd[:, None] - edges).argmin(axis=1)
    found = []
    for number in range(len(edges)):
        some = nearest == number
        if not some.any():
            continue
        at = float(jnd[some].mean())
        low, high = wilson(int(second[some].sum()), int(some.sum()))
        found.append(
            {
                "jnd": at,
                "answers": int(some.sum()),
                "second_percent": 100.0 * float(second[some].mean()),
                "low_percent": 100.0 * low,
                "high_percent": 100.0 * high,
                "predicted_percent": 100.0 * float(ndtr(at)),
            }
        )
    return found


def wilson(right: int, count: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    ends = stats.binomtest(right, count).proportion_ci(0.95, "wilson")
    return float(ends.low), float(ends.high)


def _matrix(question: Question, plates: Mapping[str, SetPlate], quantity: str, ratio: float) -> list[Entry]:
    """How often each plate was told above each other of its texture, and should be: the paper's figure 25."""
    counts: dict[tuple[str, str], list[int]] = {}
    for pair in itertools.chain(*question.pairs):
        if plates[pair.first].texture == plates[pair.second].texture:
            lower, upper = sorted(
                (pair.first, pair.second), key=lambda label: float(getattr(plates[label], quantity))
            )
            counts.setdefault((upper, lower), []).append(pair.told == upper)
    rows = []
    for (upper, lower), told in counts.items():
        jnd = math.log(getattr(plates[upper], quantity) / getattr(plates[lower], quantity)) / math.log(ratio)
        low, high = wilson(sum(told), len(told))
        rows.append(
            {
                "texture": plates[upper].texture,
                "above": upper,
                "below": lower,
                "answers": len(told),
                "told_percent": 100.0 * sum(told) / len(told),
                "low_percent": 100.0 * low,
                "high_percent": 100.0 * high,
                "predicted_percent": 100.0 * float(ndtr(jnd)),
            }
        )
    return sorted(rows, key=lambda row: (row["texture"], row["above"], row["below"]))


def order(question: Question, plates: Mapping[str, SetPlate], quantity: str) -> list[Entry]:
    """Rank correlation of the quantity with how often plates were told above others, by texture."""
    above: dict[str, list[bool]] = {}
    for pair in itertools.chain(*question.pairs):
        if plates[pair.first].texture == plates[pair.second].texture:
            above.setdefault(pair.first, []).append(not pair.second_told)
            above.setdefault(pair.second, []).append(pair.second_told)
    shares = {label: float(np.mean(told)) for label, told in above.items()}
    return correlations(shares, plates, quantity)


def correlations(
    scores: Mapping[str, float], plates: Mapping[str, SetPlate], quantity: str = "roughness"
) -> list[Entry]:
    """Rank correlations, Spearman's and Kendall's, of scores of plates with a quantity, by texture."""
    by_texture: dict[str, list[str]] = {}
    for label in scores:
        by_texture.setdefault(plates[label].texture, []).append(label)
    found = []
    for texture, labels in by_texture.items():
        told = [scores[label] for label in labels]
        values = [float(getattr(plates[label], quantity)) for label in labels]
        if len(labels) < 3 or len(set(told)) < 2 or len(set(values)) < 2:
            continue
        found.append(
            {
                "texture": texture,
                "plates": len(labels),
                "spearman": float(stats.spearmanr(told, values).statistic),
                "kendall": float(stats.kendalltau(told, values).statistic),
            }
        )
    return found
