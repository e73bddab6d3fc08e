"""The answers to a set, analysed: everything that `answers.json` and the page of the answers hold."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from relief.ground.errors import InputError
from retouch.laboratory.people.comparisons import QUANTITIES, Question, compared
from retouch.laboratory.people.plan import pairs_of, planned
from retouch.laboratory.people.plates import SetPlate, read_plates
from retouch.laboratory.people.power import power
from retouch.laboratory.people.ranks import judged_same, rated_plates, sorted_plates
from retouch.laboratory.people.reading import COLDER, ROUGHER, SAME, Answers, read_answers
from retouch.laboratory.people.tables import Row
from retouch.laboratory.people.whose_finger import fingers

Entry = dict[str, Any]
BEHIND = 3.0
"""Difference of log-likelihoods from which another finger counts as worse: 20 to 1."""


def analysed(
    folder: Path, files: Sequence[Path], partial: bool, without: Sequence[str]
) -> tuple[Entry, Answers | None, dict[str, SetPlate]]:
    """Everything that the answers say.

    Args:
        folder: of the set.
        files: of answers; none tells what the plan can tell.
        partial: whether people may have left trials of the plan out.
        without: people to leave out.

    Returns:
        The content of `answers.json`, the answers, and the plates of the set.

    Raises:
        InputError: the folder is no finished set, or the answers are not to it.
    """
    plates = read_plates(folder, fingers=bool(files))
    plans = planned(folder)
    content: Entry = {"set": str(folder), "files": [str(file) for file in files]}
    content |= {"power": _power(plans, plates)}
    if not files:
        if not any(content["power"].values()):
            raise InputError(f"{folder}: has no plan; retouch stimuli --redraw -o {folder} writes one")
        return content, None, plates
    answers = read_answers(files, plates, plans, partial, without)
    pairs = {name: Question.of(name, answers.pairs[name]) for name in QUANTITIES if answers.pairs.get(name)}
    content |= {"weber": None, "people": [], "fingers": [], "best_finger": None}
    if ROUGHER in pairs:
        content |= compared(pairs[ROUGHER], plates) | fingers(pairs[ROUGHER], plates)
    content["colder"] = compared(pairs[COLDER], plates) if COLDER in pairs else None
    content["same"] = judged_same(answers.pairs[SAME], plates) if answers.pairs.get(SAME) else None
    content["sorts"] = sorted_plates(answers.sorts, plates) if answers.sorts else None
    content["magnitudes"] = rated_plates(answers.magnitudes, plates) if answers.magnitudes else None
    content["own_finger"] = None
    content["notes"] = [*answers.notes, *_notes(content)]
    return content, answers, plates


def _power(plans: Mapping[str, Mapping[tuple[str, int], Row]], plates: Mapping[str, SetPlate]) -> Entry:
    """What the plan can tell, by question."""
    found: Entry = {}
    for question, (quantity, ratio) in QUANTITIES.items():
        trials = plans.get(question)
        if not trials:
            found[question] = None
            continue
        people = len({person for person, _ in trials})
        try:
            differences = [
                math.log(getattr(plates[second], quantity) / getattr(plates[first], quantity))
                for first, second in pairs_of(trials)
            ]
        except KeyError as error:
            raise InputError(f"the plan of {question} has {error}, which is no plate of this set") from None
        found[question] = power(differences, ratio, people)
    return found


def _notes(content: Entry) -> list[str]:
    """What a person should know of the results, a line each."""
    notes = []
    if (people := len(content["people"])) == 1:
        notes.append("one person's answers say nothing of other people")
    if content["weber"] is not None and content["weber_high"] is not None:
        half = 50.0 * (content["weber_high"] - content["weber_low"]) / content["weber"]
        predicted = content["predicted"]["weber"]
        verdict = "holds" if content["weber_low"] <= predicted <= content["weber_high"] else "excludes"
        notes.append(
            f"the JND of {people} people is known to about ±{half:.0f} %; its interval {verdict} the "
            f"predicted {100.0 * predicted:.0f} %"
        )
    elif people:
        notes.append("the answers give no JND, but a bound of it")
    if felt := content["fingers"]:
        near = [one["name"] for one in felt[1:] if one["behind"] < BEHIND]
        said = f"{felt[0]['name']} explains the answers best"
        notes.append(f"{said}; not told from it: {', '.join(near)}" if near else said)
    return notes
