"""What sorts, magnitudes and judgements of likeness say, beside what is predicted of a set."""

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from statistics import fmean, stdev

import numpy as np
from scipy import stats

from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.reading import MAGNITUDES, SORTS, YES, JudgedPair, Magnitude, Sort
from retouch.laboratory.people.scores import (
    RankCorrelation,
    correlations,
    people_reversed,
    ranked,
    rated,
    raters_reversed,
    wilson,
)
from retouch.laboratory.people.tables import grouped
from retouch.laboratory.stimulus_sets import prediction
from retouch.laboratory.stimulus_sets.levels import ROUGHNESS
from tactile.jnd import jnd_apart

SAME_HALF = 0.5
"""Share of answers from which on a plate passes for its texture, as section 5.3 of the paper counts."""


@dataclass(frozen=True)
class SortResults:
    """How often people sorted by V, and should: neighbours, whole sets, plates two or more steps apart."""

    sorts: int
    people: int
    neighbours_percent: float
    neighbours_low: float | None
    neighbours_high: float | None
    neighbours_std: float | None
    sorted_percent: float
    far_discrepancies: int
    predicted_neighbours_percent: float
    predicted_sorted_percent: float
    predicted_far_discrepancies: float
    order: tuple[RankCorrelation, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class RatedPlate:
    """Geometric mean of the numbers that people gave a plate, relative to their own means."""

    plate: str
    relative_magnitude: float
    ratings: int


@dataclass(frozen=True)
class RatingResults:
    """How the numbers that people gave go by V: the exponent of a power law, and rank correlations."""

    ratings: int
    people: int
    exponent: float | None
    exponent_low: float | None
    exponent_high: float | None
    plates: tuple[RatedPlate, ...]
    order: tuple[RankCorrelation, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class JudgedPlate:
    """How often a plate passed for its texture by sight, %."""

    plate: str
    kind: str
    answers: int
    same_percent: float
    low_percent: float
    high_percent: float
    picture_change_percent: float | None


@dataclass(frozen=True)
class JudgedKind:
    """The plates of a kind: how many, how often the same, and how many passed."""

    plates: int
    same_percent: float
    passed: int


@dataclass(frozen=True)
class SameResults:
    """How often plates pass for their texture, by kind and one by one."""

    answers: int
    kinds: Mapping[str, JudgedKind]
    plates: tuple[JudgedPlate, ...]


def mean_with_interval(values: Sequence[float]) -> tuple[float, float | None, float | None]:
    """Mean over people with its 95 % interval by Student's t; no ends for one person."""
    mean = fmean(values)
    if len(values) < 2:
        return mean, None, None
    half = float(stats.t.ppf(0.975, len(values) - 1)) * stdev(values) / math.sqrt(len(values))
    return mean, mean - half, mean + half


def sorted_plates(sorts: Sequence[Sort], plates: Mapping[str, SetPlate]) -> SortResults:
    """How often neighbours, whole sets and plates two or more steps apart are sorted by V, and should be."""
    turned = people_reversed(SORTS, ((sort.person, sort.labels) for sort in sorts), plates)
    sorts = [sort for sort in sorts if sort.person not in turned.left_out]
    by_person: dict[str, list[float]] = {}
    whole, far = [], []
    expected = []
    for sort in sorts:
        rank = {label: k for k, label in enumerate(sort.labels)}
        order = sorted(sort.labels, key=lambda label: plates[label].roughness)
        ranks = [rank[label] for label in order]
        neighbours = [one < other for one, other in pairwise(ranks)]
        by_person.setdefault(sort.person, []).extend(map(float, neighbours))
        whole.append(ranks == sorted(ranks))
        far.append(any(ranks[i] > ranks[j] for i in range(len(ranks)) for j in range(i + 2, len(ranks))))
        lowest = plates[order[0]].roughness
        expected.append(_expected(tuple(jnd_apart(plates[label].roughness, lowest) for label in order)))
    each = [100.0 * fmean(shares) for shares in by_person.values()]
    mean, low, high = mean_with_interval(each)
    scores = ranked((sort.labels for sort in sorts), plates)
    of_neighbours, of_whole, of_far = zip(*expected, strict=True)
    return SortResults(
        sorts=len(sorts),
        people=len(by_person),
        neighbours_percent=mean,
        neighbours_low=low,
        neighbours_high=None if high is None else min(100.0, high),
        neighbours_std=stdev(each) if len(each) > 1 else None,
        sorted_percent=100.0 * fmean(whole),
        far_discrepancies=sum(far),
        predicted_neighbours_percent=100.0 * fmean(of_neighbours),
        predicted_sorted_percent=100.0 * fmean(of_whole),
        predicted_far_discrepancies=math.fsum(of_far),
        order=correlations(scores, plates),
        notes=(*turned.lines, *scores.notes(SORTS)),
    )


@cache
def _expected(jnds: tuple[float, ...]) -> tuple[float, float, float]:
    """Predictions for levels by their JND; an experiment has many sorts of few sets."""
    return (
        prediction.neighbours_right(jnds),
        prediction.sorted_right(jnds),
        prediction.far_discrepancy(jnds),
    )


def rated_plates(magnitudes: Sequence[Magnitude], plates: Mapping[str, SetPlate]) -> RatingResults:
    """How the numbers that people gave go by V: exponent of a power law, and rank correlations.

    Everybody has a scale of their own, and may have had plates of their own: see `rated`.
    """
    by_person = grouped((one.person, one) for one in magnitudes)
    turned = raters_reversed(by_person, plates)
    by_person = {name: each for name, each in by_person.items() if name not in turned.left_out}
    magnitudes = list(itertools.chain(*by_person.values()))
    exponents = []
    for each in by_person.values():
        values = np.log([plates[one.plate].roughness for one in each])
        if values.std() > 0.0:
            exponents.append(float(np.polyfit(values, np.log([one.magnitude for one in each]), 1)[0]))
    scores = rated(magnitudes)
    ratings = Counter(one.plate for one in magnitudes)
    mean, low, high = mean_with_interval(exponents) if exponents else (None, None, None)
    return RatingResults(
        ratings=len(magnitudes),
        people=len(by_person),
        exponent=mean,
        exponent_low=low,
        exponent_high=high,
        plates=tuple(
            RatedPlate(label, math.exp(log), ratings[label])
            for label, log in zip(scores.labels, scores.values, strict=True)
        ),
        order=correlations(scores, plates),
        notes=(*turned.lines, *scores.notes(MAGNITUDES)),
    )


def judged_same(pairs: Sequence[JudgedPair], plates: Mapping[str, SetPlate]) -> SameResults:
    """How often plates pass for their texture by sight (section 5.3 of the paper).

    Of a pair the texture as found is the reference, and the other plate is judged.
    """

    def judged_plate(pair: JudgedPair) -> str:
        first = plates[pair.first]
        return pair.second if first.kind == ROUGHNESS and first.level == 0.0 else pair.first

    judged = []
    for label, same in grouped((judged_plate(pair), pair.told == YES) for pair in pairs).items():
        low, high = wilson(sum(same), len(same))
        judged.append(
            JudgedPlate(
                plate=label,
                kind=plates[label].kind,
                answers=len(same),
                same_percent=100.0 * fmean(same),
                low_percent=100.0 * low,
                high_percent=100.0 * high,
                picture_change_percent=plates[label].picture_change_percent,
            )
        )
    kinds = {
        kind: JudgedKind(len(each), fmean(each), sum(one >= 100.0 * SAME_HALF for one in each))
        for kind, each in grouped((plate.kind, plate.same_percent) for plate in judged).items()
    }
    return SameResults(len(pairs), kinds, tuple(judged))
