"""How often order and magnitudes are found again where people had unlike plates, blocks and sorts, simulated.

python -m benchmarks.people.unlike            # 200 experiments, half a minute of a processor
python -m benchmarks.people.unlike --quick    # 20, printed and not saved

In each of 200 experiments eight people have 3 to 5 neighbours each of 7 plates that are one JND apart. Each
compares all pairs of these in both orders one to three times (2 % lapses, side preferences of 0.3 JND), sorts
all of them and up to three times some, and rates each once or twice (V to the power of 0.8, noise of 15 %, a
scale of one's own). A ninth person has all 7 plates, and answers the other way round, or guesses. Numbers go
to results/people_unlike.json and the table into docs/evidence/people.md.
"""

from __future__ import annotations

import itertools
import math
import textwrap
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.special import ndtr
from scipy.stats import norm

from benchmarks.people.coverage import PAGE
from benchmarks.people.observers import Observer
from benchmarks.shared.common import machine, parser_of, put, save, table
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.ranks import rated_plates
from retouch.laboratory.people.reading import MAGNITUDES, ROUGHER, SORTS, Magnitude
from retouch.laboratory.people.scores import (
    RankCorrelation,
    Scores,
    correlations,
    people_reversed,
    ranked,
    rated,
    wilson,
)
from retouch.laboratory.stimulus_sets.levels import ROUGHNESS
from tactile.jnd import ROUGHNESS_JND

RESULT, COMMAND = "people_unlike", "benchmarks.people.unlike"
EXPERIMENTS, QUICK, PEOPLE = 200, 20, 8
QUESTIONS = (ROUGHER, SORTS, MAGNITUDES)
PLATES = [
    SetPlate(f"plate {k}", "stone", ROUGHNESS, k, 0.03 * ROUGHNESS_JND**k, 40.0, None, Path())
    for k in range(7)
]
PLACES = {plate.label: number for number, plate in enumerate(PLATES)}
BY_LABEL = {plate.label: plate for plate in PLATES}
EXPONENT, NOISE = 0.8, 0.15
"""Of magnitudes: exponent over V, and standard deviation of the logarithm of one."""
STEPS = {ROUGHER: 1.0, MAGNITUDES: EXPONENT * math.log(ROUGHNESS_JND)}
"""True difference of the scores of neighbours: JND, and logarithm of magnitude."""
Orders = list[tuple[str, tuple[str, ...]]]
"""Person, and labels from the lowest plate to the highest."""
COLUMNS = {
    "right": "order right without errors",
    "neighbours": "neighbours right",
    "reversed": "who is reversed is named so",
    "guessing": "who guesses is named so",
}
"""What is counted of each question, and its heading."""


def own_plates(rng: np.random.Generator) -> list[list[SetPlate]]:
    """Neighbouring plates of each person, drawn until people link all plates."""
    while True:
        first = rng.integers(0, 5, PEOPLE)
        last = np.minimum(first + rng.integers(3, 6, PEOPLE), 7)
        if all(((first <= k) & (last > k + 1)).any() for k in range(6)):
            return [PLATES[low:high] for low, high in zip(first, last, strict=True)]


def answered(
    own: Sequence[list[SetPlate]], errors: bool, rng: np.random.Generator, power: float = 1.0
) -> tuple[dict[str, Orders], list[Magnitude]]:
    """Orders of pairs and sorts, and magnitudes, of people who go by a power of V."""
    orders, magnitudes = {name: Orders() for name in (ROUGHER, SORTS)}, list[Magnitude]()
    for number, plates in enumerate(own):
        person, weber = f"P{number}", 0.19 if errors else 1e-9
        observer = Observer(weber, lambda plate: plate.roughness**power, lapses=0.02 * errors)
        observer = replace(observer, preference=0.3 * errors * rng.standard_normal())
        for one, other in list(itertools.permutations(plates, 2)) * rng.integers(1, 4):
            second = observer.second(power * math.log(other.roughness / one.roughness), weber, rng)
            orders[ROUGHER].append((person, (one.label, other.label)[:: 1 if second else -1]))
        for length in (len(plates), *rng.integers(2, len(plates) + 1, rng.integers(4))):
            some = rng.choice(len(plates), length, replace=False)
            orders[SORTS].append((person, tuple(observer.sort([plates[k] for k in some], rng))))
        scale = rng.standard_normal()
        for plate in plates * rng.integers(1, 3):
            log = scale + EXPONENT * math.log(observer.value(plate)) + NOISE * errors * rng.standard_normal()
            magnitudes.append(Magnitude(person, plate.label, math.exp(log)))
    return orders, magnitudes


def fitted(orders: Mapping[str, Orders], magnitudes: Sequence[Magnitude]) -> dict[str, Scores]:
    """Scores by the fit of all answers, by question."""
    fits = {name: ranked((order for _, order in each), BY_LABEL) for name, each in orders.items()}
    return fits | {MAGNITUDES: rated(magnitudes)}


def named(orders: Mapping[str, Orders], magnitudes: Sequence[Magnitude]) -> dict[str, int]:
    """How many people are named as reversed, by question."""
    found = {name: len(people_reversed(name, each, BY_LABEL).notes) for name, each in orders.items()}
    lines = rated_plates(magnitudes, BY_LABEL).notes
    return found | {MAGNITUDES: sum("reversed, not guessed" in line for line in lines)}


def standard_errors(
    orders: Mapping[str, Orders], magnitudes: Sequence[Magnitude], lower: int
) -> dict[str, float]:
    """Standard error of the difference of two neighbours' scores that the answers allow, by question."""
    pairs, ratings = np.zeros((7, 7)), np.zeros((PEOPLE, 7))
    for _, (low, high) in orders[ROUGHER]:
        step = PLACES[high] - PLACES[low]
        weight = norm.pdf(step) ** 2 / (ndtr(step) * ndtr(-step))
        pairs[[PLACES[low], PLACES[high]], [PLACES[high], PLACES[low]]] += weight
    for one in magnitudes:
        ratings[int(one.person[1:]), PLACES[one.plate]] += 1.0
    of_magnitudes = (ratings / ratings.sum(axis=1, keepdims=True)).T @ ratings / NOISE**2
    ends = np.eye(7)[lower + 1] - np.eye(7)[lower]
    return {
        name: math.sqrt(ends @ np.linalg.pinv(np.diag(weights.sum(axis=1)) - weights) @ ends)
        for name, weights in ((ROUGHER, pairs), (MAGNITUDES, of_magnitudes))
    }


def experiment(seed: int, found: defaultdict[str, float]) -> None:
    """Count what comes out right of an experiment, and add up what is expected."""
    rng = np.random.default_rng(seed)
    own, lower = own_plates(rng), seed % 6
    perfect = (RankCorrelation("stone", 7, 1.0, 1.0),)
    for name, fit in fitted(*answered(own, False, rng)).items():
        found[f"{name}: right"] += correlations(fit, BY_LABEL) == perfect
    orders, magnitudes = answered(own, True, rng)
    fits = fitted(orders, magnitudes)
    for name, fit in fits.items():
        found[f"{name}: neighbours"] += np.diff(fit.values)[lower] > 0.0
    told = {
        "others": (orders, magnitudes),
        "reversed": answered([PLATES], True, rng, -1.0),
        "guessing": answered([PLATES], True, rng, 0.0),
    }
    for word, each in told.items():
        for name, count in named(*each).items():
            found[f"{name}: {word}"] += count
    errors = standard_errors(orders, magnitudes, lower)
    for name, error in errors.items():
        found[f"{name}: expected"] += float(ndtr(STEPS[name] / error))
    off = np.diff(fits[MAGNITUDES].values)[lower] - STEPS[MAGNITUDES]
    found["ratio"] += abs(off) < 1.96 * errors[MAGNITUDES]
    exponent = rated_plates(magnitudes, BY_LABEL)
    ends = (exponent.exponent_low or 0.0, exponent.exponent_high or math.inf)
    found["exponent"] += ends[0] < EXPONENT < ends[1]


def summary(found: Mapping[str, float], number: int) -> str:
    """The table, with 95 % intervals of the shares of experiments."""

    def share(key: str) -> str:
        low, high = wilson(int(found[key]), number)
        return f"{found[key]:.0f} ({100.0 * low:.0f} to {100.0 * high:.0f} %)"

    rows = []
    for name in QUESTIONS:
        awaited = found.get(f"{name}: expected")
        right, neighbours, *named = (share(f"{name}: {column}") for column in COLUMNS)
        rows.append([name, right, neighbours, "-" if awaited is None else f"{awaited:.1f}", *named])
    others = sum(found[f"{name}: others"] for name in QUESTIONS)
    words = (
        f"Of {number} experiments. The ratio of two neighbours' magnitudes is within 1.96 standard errors of "
        f"the truth in {share('ratio')}, the interval of the exponent holds it in {share('exponent')}, and "
        f"{others:.0f} of the eight people who are not reversed are named so."
    )
    head = ["", *COLUMNS.values()]
    head.insert(3, "expected")
    return "\n\n".join((table(head, rows), textwrap.fill(words, 120))) + "\n"


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true")
    quick = parser.parse_args().quick
    number = QUICK if quick else EXPERIMENTS
    found = defaultdict[str, float](float)
    for seed in range(number):
        experiment(seed, found)
    text = summary(found, number)
    print(text)
    if not quick:
        counts = {name: round(float(count), 1) for name, count in found.items()}
        save(RESULT, {"machine": machine(), "experiments": number, "found": counts})
        put(PAGE, "unlike", COMMAND, text)


if __name__ == "__main__":
    main()
