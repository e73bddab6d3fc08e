"""How often intervals of the just-noticeable difference hold the truth, on simulated people.

python -m benchmarks.people.coverage [KIND ...] [--again]    # 200 experiments of each kind

The trials are those of the paper's six textures at five levels, as `results/stimuli.json` has them.
"""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.special import ndtr

from benchmarks.shared.common import load, publish, rows_of, table
from relief.ground.arrays import Array
from retouch.laboratory.people.likelihood import LAPSE_RATES, LikelihoodGrid, PairAnswers, log_likelihoods
from retouch.laboratory.people.population import Estimate, fit, weber
from retouch.laboratory.people.power import half_width, information
from tactile.jnd import ROUGHNESS_JND

EXPERIMENTS = 200
RESAMPLES = 300
"""Resampled groups of people, or of one person's answers, of a bootstrap."""


@dataclass(frozen=True)
class Kind:
    """A kind of experiment.

    Attributes:
        name: in words.
        people: number of them.
        trials: pairs of each.
        weber: fraction of V in the middle of people.
        differ: standard deviation of the logarithm of people's noise.
        lapses: lapse rate; None: each has one of an exponential with the mean of 3 %.
        preference: standard deviation of people's side preferences, JND.
    """

    name: str
    people: int = 8
    trials: int = 120
    weber: float = 0.19
    differ: float = 0.0
    lapses: float | None = 0.02
    preference: float = 0.3


KINDS = (
    Kind("the plan as it is"),
    Kind("no lapses, no preferences", lapses=0.0, preference=0.0),
    Kind("10 % lapses", lapses=0.1),
    Kind("people lapse differently", lapses=None),
    Kind("preferences of 0.6 JND", preference=0.6),
    Kind("people differ by 25 %", differ=0.25),
    Kind("people differ by 40 %", differ=0.4),
    Kind("20 people, 60 pairs, differ by 25 %", people=20, trials=60, differ=0.25),
    Kind("40 pairs each", trials=40),
    Kind("3 people, differ by 25 %", people=3, differ=0.25),
    Kind("1 person, 240 pairs", people=1, trials=240),
    Kind("JND half as large", weber=0.095),
    Kind("JND twice as large", weber=0.38),
)


def differences() -> Array:
    """Logarithms of the ratios of V of all ordered pairs of levels of the six textures."""
    found = []
    for texture in load("stimuli")["textures"].values():
        jnds = [plate["jnd"] for plate in texture["plates"]]
        found += [other - one for one in jnds for other in jnds if one is not other]
    return np.array(found) * math.log(ROUGHNESS_JND)


def drawn(kind: Kind, rng: np.random.Generator) -> tuple[list[PairAnswers], Array, Array]:
    """Answers of people, the logarithms of their noise, and their preferences in JND."""
    pairs = differences()
    noises = math.log(math.log1p(kind.weber)) + kind.differ * rng.standard_normal(kind.people)
    preferences = kind.preference * rng.standard_normal(kind.people)
    people = []
    for noise, preference in zip(noises, preferences, strict=True):
        whole, rest = divmod(kind.trials, len(pairs))
        xs = np.concatenate([np.tile(pairs, whole), rng.permutation(pairs)[:rest]])
        lapses = kind.lapses if kind.lapses is not None else min(0.2, rng.exponential(0.03))
        shares = 0.5 * lapses + (1.0 - lapses) * ndtr(xs / math.exp(noise) - preference)
        people.append(PairAnswers(xs, rng.random(len(xs)) < shares))
    return people, noises, preferences


def holds(interval: Estimate, truth: float) -> bool:
    return (interval.low is None or interval.low <= truth) and (
        interval.high is None or truth <= interval.high
    )


def bootstrapped(people: Sequence[PairAnswers], rng: np.random.Generator) -> Estimate:
    """The usual way: people drawn anew with replacement, all taken as one; 2.5 to 97.5 % of the JNDs."""
    grid = LikelihoodGrid.for_answers(len(people[0]))
    logs = log_likelihoods(people, grid)
    drawn_people = rng.multinomial(len(people), np.full(len(people), 1.0 / len(people)), RESAMPLES)
    best = (drawn_people @ logs.reshape(len(people), -1)).argmax(axis=1)
    noises = grid.noise[np.unravel_index(best, logs.shape[1:])[1]]
    low, high = np.quantile(noises, (0.025, 0.975))
    return Estimate(float(np.median(noises)), float(low), float(high))


def bootstrapped_person(person: PairAnswers, rng: np.random.Generator) -> Estimate:
    """The same for one person: answers drawn anew."""
    grid = LikelihoodGrid.for_answers(len(person))
    some = rng.integers(len(person), size=(RESAMPLES // 3, len(person)))
    again = [PairAnswers(person.differences[each], person.second[each]) for each in some]
    best = log_likelihoods(again, grid).reshape(len(again), -1).argmax(axis=1)
    noises = grid.noise[np.unravel_index(best, (len(LAPSE_RATES), len(grid.noise), len(grid.preference)))[1]]
    low, high = np.quantile(noises, (0.025, 0.975))
    return Estimate(float(np.median(noises)), float(low), float(high))


def simulated(kind: Kind, experiments: int = EXPERIMENTS) -> dict[str, Any]:
    """How often intervals of experiments hold the truth, %, and how wide they are."""
    began = time.process_time()
    rng = np.random.default_rng(abs(hash_of(kind.name)))
    truth = math.log(math.log1p(kind.weber))
    held: dict[str, list[bool]] = {}
    widths, values = [], []
    for number in range(experiments):
        people, noises, preferences = drawn(kind, rng)
        fitted = fit(people)
        held.setdefault("all", []).append(holds(fitted.middle.noise, truth))
        if kind.lapses is not None:
            held.setdefault("all_lapses", []).append(holds(fitted.middle.lapses, kind.lapses))
        for one, noise, preference in zip(fitted.each, noises, preferences, strict=True):
            held.setdefault("person", []).append(holds(one.noise, noise))
            held.setdefault("person_equality", []).append(holds(one.preference, preference))
        if kind.people > 1:
            if number < experiments // 2:
                held.setdefault("all_bootstrap", []).append(holds(bootstrapped(people, rng), truth))
            held.setdefault("all_equality", []).append(holds(fitted.middle.preference, 0.0))
        if kind is KINDS[0] and number < experiments // 2:
            interval = bootstrapped_person(people[0], rng)
            held.setdefault("person_bootstrap", []).append(holds(interval, noises[0]))
        fraction = weber(fitted.middle.noise)
        if fraction.value is not None and fraction.high is not None:
            values.append(fraction.value / kind.weber)
            widths.append(50.0 * (fraction.high - (fraction.low or 0.0)) / kind.weber)
    of_one = information(differences(), math.log1p(kind.weber))
    return {
        "kind": asdict(kind),
        "experiments": experiments,
        "held_percent": {name: 100.0 * float(np.mean(each)) for name, each in held.items()},
        "half_width_percent": float(np.median(widths)),
        "predicted_half_width_percent": 100.0
        * half_width(of_one, math.log1p(kind.weber), kind.people, kind.trials, kind.differ),
        "median_over_truth": float(np.median(values)),
        "cpu_s": time.process_time() - began,
    }


def hash_of(name: str) -> int:
    """A seed that a name always has."""
    return int.from_bytes(name.encode()[:6], "little")


def main() -> None:
    measures = {kind.name: partial(simulated, kind) for kind in KINDS}
    publish(
        "people",
        "coverage",
        report(rows_of(__doc__, "people_coverage", "kinds", measures)),
    )


def report(kinds: dict[str, Any]) -> str:
    """The table of coverage: the least and the most over the kinds of experiments, and by bootstrap."""
    rows = []
    for key, words in SHOWN.items():
        held = [one["held_percent"].get(each) for each in (key, f"{key}_bootstrap") for one in kinds.values()]
        both = (held[: len(kinds)], held[len(kinds) :])
        ends = (sorted({f"{share:.1f}" for share in each if share is not None}, key=float) for each in both)
        rows.append((words, *(" to ".join(dict.fromkeys((*each[:1], *each[-1:]))) or "-" for each in ends)))
    return table(("interval", "holds the truth, %", "by bootstrap, %"), rows)


SHOWN = {
    "all": "JND of all",
    "all_equality": "point of equality of all",
    "all_lapses": "lapse rate of all",
    "person": "JND of a person",
    "person_equality": "point of equality of a person",
}
"""Rows: how often, %, an interval holds the truth."""


if __name__ == "__main__":
    main()
