"""The answers to a set, analysed: everything in `answers.json` and on the page of the answers."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from relief.ground.errors import InputError
from retouch.laboratory.people.comparisons import QUANTITIES, PairResults, Question, compared
from retouch.laboratory.people.plan import planned
from retouch.laboratory.people.plates import SetPlate, labels_of, read_plates
from retouch.laboratory.people.power import Power, power
from retouch.laboratory.people.ranks import (
    RatingResults,
    SameResults,
    SortResults,
    judged_same,
    rated_plates,
    sorted_plates,
)
from retouch.laboratory.people.reading import COLDER, ROUGHER, SAME, read_answers
from retouch.laboratory.people.tables import ColumnMap, Plan
from retouch.laboratory.people.whose_finger import FingerFit, fingers

TOO_WIDE = 60.0
"""Half width of the interval of a JND, %, from which holding a prediction means nothing."""
BEHIND = 3.0
"""Difference of log-likelihoods from which another finger counts as worse: 20 to 1."""


@dataclass(frozen=True)
class AnswersResults:
    """What people's answers to a set say; without files of answers, what the plan can say.

    Attributes:
        folder: of the set.
        files: of answers.
        textures: names of those of the set.
        power: of the plan, by question; None where it has no trials.
        rougher, colder: by the questions about pairs.
        fingers: whose feel explains the answers best, the likeliest first.
        same, sorts, magnitudes: by the other questions.
        notes: what a person should know, a line each.
    """

    folder: Path
    files: tuple[Path, ...]
    textures: tuple[str, ...]
    power: Mapping[str, Power | None]
    rougher: PairResults | None = None
    colder: PairResults | None = None
    fingers: tuple[FingerFit, ...] = ()
    same: SameResults | None = None
    sorts: SortResults | None = None
    magnitudes: RatingResults | None = None
    notes: tuple[str, ...] = ()

    @property
    def asked(self) -> list[tuple[str, PairResults]]:
        """The questions about pairs that people answered, and their results."""
        results = ((ROUGHER, self.rougher), (COLDER, self.colder))
        return [(question, one) for question, one in results if one is not None]

    def as_json(self) -> dict[str, Any]:
        """The content of `answers.json`."""
        content: dict[str, Any] = {
            "set": str(self.folder),
            "files": [str(file) for file in self.files],
            "power": {question: _plain(one) for question, one in self.power.items()},
        }
        if not self.files:
            return content
        # What is there without answers about roughness stands first.
        content |= {"weber": None, "people": [], "fingers": [asdict(one) for one in self.fingers]}
        content |= {"best_finger": self.fingers[0].name if self.fingers else None}
        content |= {} if self.rougher is None else self.rougher.as_json()
        return content | {
            "colder": None if self.colder is None else self.colder.as_json(),
            "same": _plain(self.same),
            "sorts": _plain(self.sorts),
            "magnitudes": _plain(self.magnitudes),
            "notes": list(self.notes),
        }


def _plain(results: Power | SameResults | SortResults | RatingResults | None) -> dict[str, Any] | None:
    return None if results is None else asdict(results)


def analysed(
    folder: Path, files: Sequence[Path], partial: bool, without: Sequence[str], mapped: ColumnMap
) -> AnswersResults:
    """Everything that the answers say.

    Args:
        folder: of the set.
        files: of answers; without any, the plan alone is analysed.
        partial: whether people may have left trials of the plan out.
        without: people to leave out.
        mapped: what stands for the columns and values in the files.

    Raises:
        InputError: the folder is no finished set, or the answers are not to it.
    """
    plates = read_plates(folder, fingers=bool(files))
    plans = planned(folder, labels_of(plates))
    textures = tuple(dict.fromkeys(plate.texture for plate in plates.values()))
    plan_power = _power(plans, plates)
    if not files:
        if not any(plan_power.values()):
            raise InputError(f"{folder}: has no plan; retouch stimuli --redraw -o {folder} writes one")
        return AnswersResults(folder, (), textures, plan_power)
    answers = read_answers(files, plates, plans, partial, without, mapped)
    pairs = {name: Question.of(name, answers.pairs[name]) for name in QUANTITIES if answers.pairs.get(name)}
    asked = {name: compared(question, plates) for name, question in pairs.items()}
    for name, found in asked.items():
        pairs[name] = pairs[name].without(found.left_out)
    results = AnswersResults(
        folder,
        tuple(files),
        textures,
        plan_power,
        rougher=asked.get(ROUGHER),
        fingers=fingers(pairs[ROUGHER], plates) if ROUGHER in pairs else (),
        colder=asked.get(COLDER),
        same=judged_same(answers.pairs[SAME], plates) if answers.pairs.get(SAME) else None,
        sorts=sorted_plates(answers.sorts, plates) if answers.sorts else None,
        magnitudes=rated_plates(answers.magnitudes, plates) if answers.magnitudes else None,
    )
    return replace(results, notes=(*answers.notes, *_notes(results)))


def _power(plans: Mapping[str, Plan], plates: Mapping[str, SetPlate]) -> dict[str, Power | None]:
    """What the plan can say, by question."""
    found: dict[str, Power | None] = {}
    for question, (quantity, ratio) in QUANTITIES.items():
        trials = plans.get(question)
        if not trials:
            found[question] = None
            continue
        people = len({person for person, _ in trials})
        try:
            differences = [
                math.log(getattr(plates[second], quantity) / getattr(plates[first], quantity))
                for first, second in trials.values()
            ]
        except KeyError as error:
            raise InputError(f"the plan of {question} has {error}, which is no plate of this set") from None
        found[question] = power(differences, ratio, people)
    return found


def _notes(results: AnswersResults) -> Iterator[str]:
    """What a person should know of the results, a line each."""
    for each in (results.rougher, results.colder, results.sorts, results.magnitudes):
        yield from () if each is None else each.notes
    if (found := results.rougher) is not None:
        people, one = len(found.people) - len(found.left_out), found.fractions
        if people == 1:
            yield "one person's answers say nothing of other people"
        if one.weber is not None and one.weber_high is not None:
            half = 50.0 * (one.weber_high - one.weber_low) / one.weber
            predicted = found.predicted_weber
            inside = one.weber_low <= predicted <= one.weber_high
            verdict = "excludes" if not inside else "holds" if half < TOO_WIDE else "is too wide to test"
            yield (
                f"the JND of {people} people is known to about ±{half:.0f} %; its interval {verdict} the "
                f"predicted {100.0 * predicted:.0f} %"
            )
        else:
            yield "the answers give no JND, but a bound of it"
    if results.fingers:
        best, *others = results.fingers
        near = [other.name for other in others if other.behind < BEHIND]
        if near:
            yield f"the answers do not decide between the fingers {', '.join((best.name, *near))}"
        else:
            yield f"of the fingers, {best.name} explains the answers best"
