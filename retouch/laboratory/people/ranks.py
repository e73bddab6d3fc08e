"""What sorts, magnitudes and judgements of likeness say, beside what is predicted of a set.

People may have had unlike plates, so that a mean over those who had a plate is no score of the plate. All
answers are fitted together: magnitudes by least squares as log magnitude = person + plate, sorts and pairs by

    P(i above j) = 1 / (1 + exp(score of j - score of i))

for every pair that they imply (Bradley and Terry 1952, doi:10.2307/2334029). Pairs of sorts of unlike length
give consistent scores (Azari Soufiani et al. 2013, Generalized method-of-moments for rank aggregation).
"""

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from statistics import fmean, stdev

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.sparse import csgraph
from scipy.special import expit

from relief.ground.arrays import Array
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.reading import MAGNITUDES, SORTS, YES, JudgedPair, Magnitude, Sort
from retouch.laboratory.stimulus_sets import prediction
from retouch.laboratory.stimulus_sets.levels import ROUGHNESS
from tactile.jnd import jnd_apart

REVERSED = 2.4
"""Standard deviations below chance of pairs right, or of a slope, from which on a person answered the other
way round: a reversed sort of five plates has 2.45, and about 1 % of people who guess have more than 2.4."""
RIDGE = 1e-8
"""Precision of the normal prior of scores: without errors they are finite, in the order answered."""
ROUNDING = 1e-12
"""Sum of squares of logarithms, or share of one, that is rounding."""
MOST_STEPS = 200
"""Most Newton steps of a fit of scores; without errors it takes about 20."""
SAME_HALF = 0.5
"""Share of answers from which on a plate passes for its texture, as section 5.3 of the paper counts."""


@dataclass(frozen=True)
class RankCorrelation:
    """Rank correlations of a quantity with scores of the plates of a texture."""

    texture: str
    plates: int
    spearman: float
    kendall: float


@dataclass(frozen=True)
class Scores:
    """Scores of plates by people's answers.

    Attributes:
        labels: of the plates.
        values: (n,) scores.
        ordered: (n, n) whether answers order two plates, directly or by way of other plates; True for plates
            that are not to be compared.
    """

    labels: list[str]
    values: Array
    ordered: NDArray[np.bool_]

    def notes(self, question: str) -> tuple[str, ...]:
        """A line that names two plates whose order the answers leave open; none without such plates."""
        missing = np.argwhere(np.triu(~self.ordered))
        if not len(missing):
            return ()
        one, other = (self.labels[number] for number in missing[0])
        return (
            f"{question}: no answers order {one} and {other}, not even by way of other plates "
            f"({len(missing)} such pairs); scores and rank correlations hold among plates that answers order",
        )


@dataclass(frozen=True)
class Reversed:
    """People who answered the other way round.

    Attributes:
        notes: on each of them, by name.
        left_out: who does not count among everybody: all of them, or nobody if more than half of the people
            are, as the prediction or a column may be wrong then.
        lines: that name them.
    """

    notes: Mapping[str, str]
    left_out: tuple[str, ...]
    lines: tuple[str, ...]


def people_reversed(
    question: str,
    orders: Iterable[tuple[str, Sequence[str]]],
    plates: Mapping[str, SetPlate],
    quantity: str = "roughness",
) -> Reversed:
    """Find people who have significantly fewer pairs right than by chance (Kendall's S, summed over orders).

    Args:
        question: its name.
        orders: a person each, and labels from the lowest plate to the highest.
        plates: of the set, by label.
        quantity: of plates by which pairs are right; only plates of one texture are compared.
    """
    right, pairs, variance = Counter[str](), Counter[str](), Counter[str]()
    for person, labels in orders:
        for order in by_texture(labels, plates).values():
            values = [float(getattr(plates[label], quantity)) for label in order]
            rises = [low < high for low, high in itertools.combinations(values, 2) if low != high]
            right[person] += sum(rises)
            pairs[person] += len(rises)
            variance[person] += len(order) * (len(order) - 1) * (2 * len(order) + 5)
    notes = {
        person: f"told {right[person]} of {count} pairs right: reversed, not guessed"
        for person, count in pairs.items()
        if 2 * right[person] - count < -REVERSED * math.sqrt(variance[person] / 18)
    }
    return _reversed(question, notes, len(pairs))


def _reversed(question: str, notes: Mapping[str, str], people: int) -> Reversed:
    """People by notes on them, of so many people."""
    left_out = tuple(notes) if 2 * len(notes) <= people else ()
    done = "left out of everybody's results" if left_out else "kept, as more than half of the people are"
    lines = tuple(
        f"{question}: {person} {note}; {done}. Are these answers to be turned round, or {person} to be left "
        f"out altogether (--without {person})?"
        for person, note in notes.items()
    )
    return Reversed(notes, left_out, lines)


def by_texture(labels: Iterable[str], plates: Mapping[str, SetPlate]) -> dict[str, list[str]]:
    """Labels by texture."""
    found: dict[str, list[str]] = {}
    for label in labels:
        found.setdefault(plates[label].texture, []).append(label)
    return found


def ranked(orders: Iterable[Sequence[str]], plates: Mapping[str, SetPlate]) -> Scores:
    """Scores of plates by all pairs of one texture in orders, each from the lowest plate to the highest."""
    pairs = [
        pair
        for labels in orders
        for order in by_texture(labels, plates).values()
        for pair in itertools.combinations(order, 2)
    ]
    labels, places = np.unique(np.array(pairs).ravel(), return_inverse=True)
    above = np.zeros((len(labels), len(labels)))
    np.add.at(above, (places[1::2], places[::2]), 1.0)
    reached = np.isfinite(csgraph.shortest_path(above > 0.0)) if pairs else above > 0.0
    textures = np.array([plates[label].texture for label in labels])
    ordered = reached | reached.T | (textures[:, None] != textures)
    return Scores(labels.tolist(), bradley_terry(above), ordered)


def bradley_terry(above: Array) -> Array:
    """(n,) scores, likeliest with a weak prior, from how often each plate ranks above each other, (n, n)."""
    scores = np.zeros(len(above))
    pairs = above + above.T
    for _ in range(MOST_STEPS):
        shares = expit(scores[:, None] - scores)
        gradient = (above * shares.T - above.T * shares).sum(axis=1) - RIDGE * scores
        weights = pairs * shares * shares.T
        step = np.linalg.solve(np.diag(weights.sum(axis=1) + RIDGE) - weights, gradient)
        longest = np.abs(step).max(initial=0.0)
        scores += step / max(longest, 1.0)
        if longest < 1e-6:
            break
    return scores


def rated(magnitudes: Sequence[Magnitude]) -> Scores:
    """Scores of plates by least squares of log magnitude = person + plate.

    Among plates that people link, the mean of the scores over ratings is 0.
    """
    labels, place = np.unique([one.plate for one in magnitudes], return_inverse=True)
    names, row = np.unique([one.person for one in magnitudes], return_inverse=True)
    counts, sums = np.zeros((2, len(names), len(labels)))
    np.add.at(counts, (row, place), 1.0)
    np.add.at(sums, (row, place), np.log([one.magnitude for one in magnitudes]))
    ratings = counts.sum(axis=0)
    shares = counts / counts.sum(axis=1, keepdims=True)
    relative = sums.sum(axis=0) - shares.T @ sums.sum(axis=1)
    values = np.linalg.lstsq(np.diag(ratings) - shares.T @ counts, relative)[0]
    part = csgraph.connected_components(counts.T @ counts)[1]
    linked = part[:, None] == part
    return Scores(labels.tolist(), values - linked @ (ratings * values) / (linked @ ratings), linked)


def _falls(scores: Scores, plates: Mapping[str, SetPlate]) -> bool:
    """Whether a person's scores fall with V among plates of a texture (Student's t of the regression)."""
    logs = np.array([[math.log(plates[label].roughness) for label in scores.labels], scores.values])
    textures = np.array([plates[label].texture for label in scores.labels])
    for texture in set(textures):
        logs[:, textures == texture] -= logs[:, textures == texture].mean(axis=1, keepdims=True)
    (of_v, both), (_, of_scores) = logs @ logs.T
    freedom = len(textures) - len(set(textures)) - 1
    if freedom < 1 or min(of_v, of_scores) < ROUNDING:
        return False
    missed = max(of_v * of_scores - both**2, ROUNDING * both**2)
    t = both * math.sqrt(freedom / missed)
    return bool(stats.t.cdf(t, freedom) < stats.norm.cdf(-REVERSED))


def correlations(
    scores: Scores, plates: Mapping[str, SetPlate], quantity: str = "roughness"
) -> tuple[RankCorrelation, ...]:
    """Rank correlations, Spearman's and Kendall's, of scores of plates with a quantity, by texture.

    Where answers leave the order of plates of a texture open, each set of plates that they order has its own.
    """
    of_plates = np.array([float(getattr(plates[label], quantity)) for label in scores.labels])
    textures = np.array([plates[label].texture for label in scores.labels])
    found = []
    for texture in dict.fromkeys(textures.tolist()):
        rest = np.flatnonzero(textures == texture)
        while len(some := rest):
            # Plates whose place among most others is open are set aside first.
            while not (known := scores.ordered[np.ix_(some, some)]).all():
                some = np.delete(some, known.sum(axis=1).argmin())
            rest = np.setdiff1d(rest, some)
            ranks, values = np.round(scores.values[some], 6), of_plates[some]
            if len(some) < 3 or np.ptp(ranks) == 0.0 or np.ptp(values) == 0.0:
                continue
            both = stats.spearmanr(ranks, values), stats.kendalltau(ranks, values)
            # An order without errors is exactly 1.
            each = (round(float(one.statistic), 12) for one in both)
            found.append(RankCorrelation(texture, len(some), *each))
    return tuple(found)


def wilson(right: int, count: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927)."""
    ends = stats.binomtest(right, count).proportion_ci(0.95, "wilson")
    return float(ends.low), float(ends.high)


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
    by_person: dict[str, list[Magnitude]] = {}
    for one in magnitudes:
        by_person.setdefault(one.person, []).append(one)
    falling = [name for name, each in by_person.items() if _falls(rated(each), plates)]
    notes = dict.fromkeys(falling, "gave numbers that fall with V: reversed, not guessed")
    turned = _reversed(MAGNITUDES, notes, len(by_person))
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
    judgements: dict[str, list[bool]] = {}
    for pair in pairs:
        first = plates[pair.first]
        is_texture = first.kind == ROUGHNESS and first.level == 0.0
        judgements.setdefault(pair.second if is_texture else pair.first, []).append(pair.told == YES)
    judged = []
    for label, same in judgements.items():
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
    by_kind: dict[str, list[float]] = {}
    for plate in judged:
        by_kind.setdefault(plate.kind, []).append(plate.same_percent)
    kinds = {
        kind: JudgedKind(len(each), fmean(each), sum(one >= 100.0 * SAME_HALF for one in each))
        for kind, each in by_kind.items()
    }
    return SameResults(len(pairs), kinds, tuple(judged))
