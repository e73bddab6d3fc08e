"""Scores of plates by people's answers, and people who answered the other way round.

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

import numpy as np
from numpy.typing import NDArray
from scipy import stats
from scipy.sparse import csgraph
from scipy.special import expit

from relief.ground.arrays import Array
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.reading import MAGNITUDES, Magnitude
from retouch.laboratory.people.tables import grouped

REVERSED = 2.4
"""Standard deviations below chance of pairs right, or of a slope, from which on a person answered the other
way round: a reversed sort of five plates has 2.45, and about 1 % of people who guess have more than 2.4."""
RIDGE = 1e-8
"""Precision of the normal prior of scores: without errors they are finite, in the order answered."""
ROUNDING = 1e-12
"""Sum of squares of logarithms, or share of one, that is rounding."""
MOST_STEPS = 200
"""Most Newton steps of a fit of scores; without errors it takes about 20."""


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
    return grouped((plates[label].texture, label) for label in labels)


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


def raters_reversed(by_person: Mapping[str, Sequence[Magnitude]], plates: Mapping[str, SetPlate]) -> Reversed:
    """Find people whose magnitudes fall significantly with V.

    Args:
        by_person: magnitudes.
        plates: of the set, by label.
    """
    falling = [name for name, each in by_person.items() if _falls(rated(each), plates)]
    notes = dict.fromkeys(falling, "gave numbers that fall with V: reversed, not guessed")
    return _reversed(MAGNITUDES, notes, len(by_person))


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
