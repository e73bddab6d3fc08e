"""How often a finger is found again in simulated answers: the proposal's intervals, and the best of the
table.

python -m benchmarks.people.fingers DIR      # the finished set of `benchmarks.surfaces.stimuli`
python -m benchmarks.people.fingers          # more experiments, from what an earlier call felt of the plates
python -m benchmarks.people.fingers --quick  # 5 experiments, printed and not saved

In each of 200 experiments eight people with one finger of unknown stiffness and receptor depth compare 120
pairs each; JND 19 %, 2 % lapses, side preferences of 0.3 JND. Numbers go to results/people_fingers.json and
the table into docs/evidence/people.md. An interrupted command goes on.
"""

from __future__ import annotations

import math
import textwrap
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RectBivariateSpline

from benchmarks.people.coverage import PAGE
from benchmarks.shared.common import load, machine, parser_of, put, save, table
from retouch.laboratory.people.comparisons import Question
from retouch.laboratory.people.plan import plan
from retouch.laboratory.people.plates import SetPlate, levels_of, read_plates
from retouch.laboratory.people.reading import ROUGHER, JudgedPair
from retouch.laboratory.people.skin_fit.proposal import fitted_skin, held_out
from retouch.laboratory.people.skin_fit.tried_fingers import (
    DEPTHS,
    STIFFNESS,
    Felt,
    felt_by,
    fitted_logs,
    varied,
)
from retouch.laboratory.people.whose_finger import fingers
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment
from tactile.skin import Skin
from tests.retouch.laboratory.people.observers import Observer, answered

RESULT = "people_fingers"
COMMAND = "benchmarks.people.fingers"
EXPERIMENTS, QUICK, SAVED = 200, 5, 10
"""Experiments, those of a quick look, and after how many the results are saved."""
STIFFNESS_RANGE, DEPTH_RANGE = (0.4, 2.5), (0.7, 1.4)
"""Factors of the true fingers, evenly drawn (of stiffness in the logarithm)."""
NAMED = {
    "this finger": (1.0, 1.0),
    "softer skin": (0.5, 1.0),
    "stiffer skin": (2.0, 1.0),
    "shallower receptors": (1.0, 2.0 / 3.0),
    "deeper receptors": (1.0, 4.0 / 3.0),
}
"""Fingers of every report, as `tactile.fingers` has them."""


def all_pairs(plates: dict[str, SetPlate]) -> Question:
    """Every pair of levels once, so that every plate is felt."""
    pairs = [
        JudgedPair("A", one.label, other.label, one.label)
        for each in levels_of(plates).values()
        for one in each
        for other in each
        if one is not other
    ]
    return Question.of(ROUGHER, pairs)


def felt_of(folder: Path | None) -> tuple[Felt, dict[str, SetPlate]]:
    """What fingers feel of the plates of a set, now or by an earlier call."""
    if folder is not None:
        plates = read_plates(folder)
        felt = felt_by(Skin(), all_pairs(plates), plates)
        save(RESULT, {"labels": felt.labels, "logs": np.round(felt.logs, 5).tolist(), "experiments": []})
    kept = load(RESULT)
    if not kept:
        raise SystemExit("name the folder of a finished set")
    labels, logs = tuple(kept["labels"]), np.array(kept["logs"])
    skins = tuple(tuple(varied(Skin(), one, other) for other in DEPTHS) for one in STIFFNESS)
    values = interpolated(Felt(skins, labels, logs))
    named = {name: values(*factors) for name, factors in NAMED.items()}
    found = {
        label: SetPlate(
            label,
            label.split(" ")[0],
            "roughness",
            float(label.split(" ")[1]),
            named["this finger"][label],
            30.0,
            None,
            Path(),
            {name: each[label] for name, each in named.items()},
        )
        for label in labels
    }
    return Felt(skins, labels, logs), found


def interpolated(felt: Felt) -> Any:
    """A function from factors of stiffness and depth to V by label."""
    splines = [
        RectBivariateSpline(np.log(STIFFNESS), DEPTHS, felt.logs[..., n]) for n in range(len(felt.labels))
    ]

    def values(stiffness: float, depth: float) -> dict[str, float]:
        logs = [float(spline.ev(math.log(stiffness), depth)) for spline in splines]
        return dict(zip(felt.labels, np.exp(logs).tolist(), strict=True))

    return values


def experiment(number: int, felt: Felt, plates: dict[str, SetPlate]) -> dict[str, Any]:
    """One experiment: its truth, the proposal, and which finger the table of the report names first."""
    rng = np.random.default_rng(number)
    stiffness = math.exp(rng.uniform(*np.log(STIFFNESS_RANGE)))
    depth = rng.uniform(*DEPTH_RANGE)
    values = interpolated(felt)
    question = simulated_answers(plates, values(stiffness, depth), number, rng)
    began = time.process_time()
    fitted, _ = fitted_skin(fitted_logs(question, felt), Skin())
    cpu_s = time.process_time() - began
    held = held_out(question, felt, plates)
    name = list(NAMED)[number % len(NAMED)]
    best = fingers(simulated_answers(plates, values(*NAMED[name]), number, rng), plates)
    return {
        "truth": {"young_modulus_mpa": 0.5 * stiffness, "depth_mm": 0.75 * depth},
        "fitted": [one.as_json() for one in fitted],
        "held_out": None if held is None else asdict(held),
        "named": name,
        "best": best[0].name,
        "behind_of_named": next(one.behind for one in best if one.name == name),
        "cpu_s": cpu_s,
    }


def simulated_answers(
    plates: dict[str, SetPlate], values: dict[str, float], seed: int, rng: np.random.Generator
) -> Question:
    """Answers of eight people with one finger to a plan of 120 pairs each."""
    people = [
        Observer(0.19, lambda plate: values[plate.label], lapses=0.02, preference=0.3 * rng.standard_normal())
        for _ in range(8)
    ]
    lines = answered(ROUGHER, plan(plates, Experiment(seed=seed)), plates, people, rng).decode().splitlines()
    rows = [line.split(",") for line in lines[1:]]
    return Question.of(ROUGHER, [JudgedPair(row[0], row[2], row[3], row[4]) for row in rows])


def summary(experiments: list[dict[str, Any]]) -> str:
    """The table: coverage and widths of both numbers, and the table of fingers."""
    rows = []
    for place, key in enumerate(("young_modulus_mpa", "depth_mm")):
        each = [(one["truth"][key], one["fitted"][place]) for one in experiments]
        held = [
            (one["low"] is None or one["low"] <= true) and (one["high"] is None or true <= one["high"])
            for true, one in each
        ]
        closed = [one for _, one in each if one["low"] is not None and one["high"] is not None]
        widths = [math.log(one["high"] / one["low"]) / 2.0 for one in closed]
        errors = [abs(math.log(one["value"] / true)) for true, one in each]
        rows.append(
            [
                f"`{key}`",
                f"{100.0 * np.mean(held):.1f} %",
                f"{100.0 * len(closed) / len(each):.0f} %",
                f"x{math.exp(np.median(widths)):.2f}" if widths else "-",
                f"x{math.exp(np.median(errors)):.2f}",
            ]
        )
    right = np.mean([one["named"] == one["best"] for one in experiments])
    near = np.mean([one["behind_of_named"] < 3.0 for one in experiments])
    own = np.mean([one["held_out"]["own"] > one["held_out"]["start"] for one in experiments])
    head = ["fitted", "interval holds the truth", "both ends known", "half width", "median error"]
    words = (
        f"{len(experiments)} experiments. Where one of the five fingers of every report answered, the table "
        f"named it first in {100.0 * right:.0f} %, and less than 3 behind in {100.0 * near:.0f} %. Textures "
        f"left out were predicted better by the fitted finger than by the default in {100.0 * own:.0f} %."
    )
    return "\n\n".join((table(head, rows), textwrap.fill(words, 120))) + "\n"


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("folder", type=Path, nargs="?", metavar="DIR")
    parser.add_argument("--quick", action="store_true")
    arguments = parser.parse_args()
    felt, plates = felt_of(arguments.folder)
    kept = load(RESULT)
    done = [] if arguments.quick else kept["experiments"]
    for number in range(len(done), QUICK if arguments.quick else EXPERIMENTS):
        done.append(experiment(number, felt, plates))
        if not arguments.quick and (number + 1) % SAVED == 0:
            save(RESULT, kept | {"machine": machine(), "experiments": done})
    text = summary(done)
    print(text)
    if not arguments.quick:
        put(PAGE, "fingers", COMMAND, text)


if __name__ == "__main__":
    main()
