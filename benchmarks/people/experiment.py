"""A whole experiment of simulated people, from a set of stimuli to the page, its numbers beside the paper's.

retouch stimuli gravel-tile bark-tile knit-tile leather-tile pebbles-tile weave-tile --jnd -2,-1,0,1,2 \\
    --with-scaled --contact-area-scale 0.7,1.4 -o DIR
python -m benchmarks.people.experiment DIR

Eight people answer the plan that lies in DIR: their JND is 19 % and differs by 20 %, coldness 40 %, 2 %
lapses, side preferences of 0.3 JND, and textures pass by sight up to pictures that differ by 8 %, which is an
assumption. Numbers go to results/people_experiment.json and the table into docs/evidence/people.md.
"""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np

import retouch
from benchmarks.people.coverage import PAGE
from benchmarks.people.observers import Observer, write_answers
from benchmarks.shared.common import folder_named, machine, publish, save, table
from retouch.laboratory.people.plan import write_plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.stimulus_sets.stimulus_set import FILE, StimulusSet

RESULT, COMMAND = "people_experiment", "benchmarks.people.experiment"
SEED = 1
PAPER = {
    "neighbours sorted right, %": "85 (standard deviation 4; 10 people)",
    "sorts with plates two or more steps apart the wrong way round": "3 of 60",
    "colder told right one step apart, %": "83.1 (8 people)",
    "colder told right two steps apart, %": "91",
    "optimised plates judged the same in half of the looks or more": "20 of 24",
    "scaled plates judged the same in half of the looks or more": "4 of 24",
}
"""What the paper's participants did (sections 5.3 to 5.5)."""


def people(rng: np.random.Generator) -> list[Observer]:
    """Eight people."""
    return [
        Observer(
            weber=0.19 * math.exp(0.2 * rng.standard_normal()),
            value=lambda plate: plate.roughness,
            cold_weber=0.4 * math.exp(0.2 * rng.standard_normal()),
            lapses=0.02,
            preference=0.3 * rng.standard_normal(),
        )
        for _ in range(8)
    ]


def steps_right(matrix: list[dict[str, Any]], steps: int) -> float:
    """Share of answers told right of plates so many steps of contact area apart, %."""
    rank = {"area 0.7": 0, "0": 1, "area 1.4": 2}
    right = total = 0.0
    for row in matrix:
        above, below = (rank[row[key].split(" ", 1)[1]] for key in ("above", "below"))
        if abs(above - below) == steps:
            right += row["told_percent"] * row["answers"]
            total += row["answers"]
    return right / total


def rows_of(content: dict[str, Any]) -> list[list[str]]:
    """Simulated people, the prediction and the paper's participants, by question."""
    sorts, same = content["sorts"], content["same"]["kinds"]
    values = {
        "neighbours sorted right, %": (
            f"{sorts['neighbours_percent']:.0f} ({sorts['neighbours_std']:.0f})",
            f"{sorts['predicted_neighbours_percent']:.0f}",
        ),
        "sorts with plates two or more steps apart the wrong way round": (
            f"{sorts['far_discrepancies']} of {sorts['sorts']}",
            f"{sorts['predicted_far_discrepancies']:.1f}",
        ),
        "colder told right one step apart, %": (f"{steps_right(content['colder']['matrix'], 1):.0f}", "84"),
        "colder told right two steps apart, %": (f"{steps_right(content['colder']['matrix'], 2):.0f}", "98"),
        "optimised plates judged the same in half of the looks or more": (
            f"{same['roughness']['passed']} of {same['roughness']['plates']}",
            "-",
        ),
        "scaled plates judged the same in half of the looks or more": (
            f"{same['scaled in height']['passed']} of {same['scaled in height']['plates']}",
            "-",
        ),
    }
    return [[name, *values[name], PAPER[name]] for name in PAPER]


def fits(content: dict[str, Any]) -> list[str]:
    """What the analysis says of the simulated people, whose truth is known."""
    lines = []
    for word, found, truth in (("roughness", content, 19), ("contact area", content["colder"], 40)):
        value, low, high = (100 * found[key] for key in ("weber", "weber_low", "weber_high"))
        lines.append(f"* JND of {word}: {value:.1f} % ({low:.1f} to {high:.1f}); drawn about {truth} %.")
    value, low, high = (content["magnitudes"][f"exponent{end}"] for end in ("", "_low", "_high"))
    lines.append(f"* Magnitudes go with V to the power of {value:.2f} ({low:.2f} to {high:.2f}); drawn: 0.8.")
    lines += [f"* {note[0].upper()}{note[1:]}." for note in content["notes"]]
    return lines


def main() -> None:
    folder = folder_named(__doc__, "DIR")
    plates = read_plates(folder)
    plan = write_plan(folder, StimulusSet.read(folder / FILE).experiment)
    assert plan is not None
    observers = people(np.random.default_rng(SEED))
    files = write_answers(folder / "simulated", plan, plates, observers, SEED)
    began = time.process_time()
    content = retouch.answers(folder, [Path(file) for file in files]).content
    cpu_s = time.process_time() - began
    kept = {key: value for key, value in content.items() if key not in ("set", "files", "own_finger")}
    save(RESULT, {"machine": machine(), "cpu_s": cpu_s, "webers": [one.weber for one in observers], **kept})
    head = ["", "simulated people", "predicted", "the paper's participants"]
    text = table(head, rows_of(content)) + "\n\n" + "\n".join(fits(content))
    publish(PAGE, "experiment", COMMAND, text)


if __name__ == "__main__":
    main()
