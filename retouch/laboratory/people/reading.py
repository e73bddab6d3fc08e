"""Answers of people: tables of pairs, sorts and magnitudes, checked against the set and its plan.

The headings of a file say what it holds:

    person, first, second, rougher      label of the plate that was judged rougher (or `colder`)
    person, first, second, same         yes or no
    person, sort, place, plate          place of a plate in a sort, 1 for the smoothest
    person, plate, magnitude            a positive number

A column `trial` besides names the trial of the set's plan that a row answers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from relief.ground.errors import InputError
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.tables import CsvRow, CsvTable, read_table
from tactile.jnd import SMOOTH_BELOW, smooth_clause

ROUGHER, COLDER, SAME, SORTS, MAGNITUDES = "rougher", "colder", "same", "sorts", "magnitudes"
"""Questions of an experiment; the first three are also the headings of the answers."""
PAIRED = (ROUGHER, COLDER, SAME)
HEADINGS = {
    ROUGHER: ("person", "first", "second", "rougher"),
    COLDER: ("person", "first", "second", "colder"),
    SAME: ("person", "first", "second", "same"),
    SORTS: ("person", "sort", "place", "plate"),
    MAGNITUDES: ("person", "plate", "magnitude"),
}
"""Headings of the files of each question."""
TRIAL = "trial"
YES, NO = "yes", "no"
MOST_PEOPLE = 300
"""Most people of an experiment: their likelihoods take 0.5 MB each."""
LEAST_TO_JUDGE = 6
"""Answers from which on one side alone says that a person always answers the same: by chance 1 of 32 does."""


@dataclass(frozen=True)
class JudgedPair:
    """An answer to a pair: labels of the plates, and the label told, or yes or no."""

    person: str
    first: str
    second: str
    told: str

    @property
    def second_told(self) -> bool:
        """Whether the second plate was told rougher or colder."""
        return self.told == self.second


@dataclass(frozen=True)
class Sort:
    """One sort of a person: labels from smoothest to roughest."""

    person: str
    labels: tuple[str, ...]


@dataclass(frozen=True)
class Magnitude:
    """A number that a person gave a plate."""

    person: str
    plate: str
    magnitude: float


@dataclass
class Answers:
    """All answers of an experiment.

    Attributes:
        pairs: by question.
        sorts: of people.
        magnitudes: of people.
        notes: what a person should know of the answers, a line each.
    """

    pairs: dict[str, list[JudgedPair]] = field(default_factory=dict)
    sorts: list[Sort] = field(default_factory=list)
    magnitudes: list[Magnitude] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def question_of(table: CsvTable) -> str:
    """The question that a file answers, by its headings. Raises InputError."""
    matches = [name for name, headings in HEADINGS.items() if set(headings) <= set(table.headings)]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise InputError(
            f"{table.file}: columns of two questions: {', '.join(matches)}; one file each, please"
        )
    kinds = "; ".join(", ".join(headings) for headings in HEADINGS.values())
    raise InputError(f"{table.file}: its columns are those of no answers: {kinds}")


def read_answers(
    files: Sequence[Path],
    plates: Mapping[str, SetPlate],
    plans: Mapping[str, Mapping[tuple[str, int], CsvRow]],
    partial: bool,
    without: Sequence[str] = (),
) -> Answers:
    """Read the answers to a set.

    Args:
        files: tables; several may answer one question.
        plates: of the set, by label.
        plans: by question, the first row of each trial of the set's plan by person and number; empty without.
        partial: whether people may have left trials of the plan out.
        without: people to leave out.

    Raises:
        InputError: a label is none of the set's; a trial is missing, double, or another than the plan's; a
            person always answers the same.
    """
    tables: dict[str, list[CsvTable]] = {}
    for file in files:
        table = read_table(file)
        tables.setdefault(question_of(table), []).append(table)
    answers = Answers()
    known: set[str] = set()
    for question, each in tables.items():
        rows = [row for table in each for row in table.rows]
        known |= {row.text("person") for row in rows}
        rows = [row for row in rows if row.cells["person"] not in without]
        plan = plans.get(question, {}) if all(TRIAL in table.headings for table in each) else {}
        rows = _answered(question, rows, plan, partial, answers.notes)
        _check_labels(question, rows, plates)
        _take(question, rows, answers)
    if unknown := set(without) - known:
        raise InputError(f"without: nobody is called {min(unknown)!r}")
    if len(known) > MOST_PEOPLE:
        raise InputError(f"{files[0]}: answers of more than {MOST_PEOPLE} people")
    if not (any(answers.pairs.values()) or answers.sorts or answers.magnitudes):
        raise InputError(f"{files[0]}: has no answers")
    return answers


def _check_labels(question: str, rows: Sequence[CsvRow], plates: Mapping[str, SetPlate]) -> None:
    names = ("plate",) if question in (SORTS, MAGNITUDES) else ("first", "second")
    for row in rows:
        for name in names:
            if row.text(name) not in plates:
                raise row.fault(f"{name}: {row.cells[name]!r} is no plate of this set")
            roughness = plates[row.text(name)].roughness
            if question in (SORTS, ROUGHER) and roughness < SMOOTH_BELOW:
                raise row.fault(f"{name}: {row.cells[name]!r} is {smooth_clause(roughness)}")


def _answered(
    question: str,
    rows: Sequence[CsvRow],
    plan: Mapping[tuple[str, int], CsvRow],
    partial: bool,
    notes: list[str],
) -> list[CsvRow]:
    """Rows with an answer, checked against the plan. Raises InputError."""
    answer = HEADINGS[question][-1] if question != SORTS else "place"
    answered: list[CsvRow] = []
    missing: list[CsvRow] = []
    for row in rows:
        (answered if row.cells[answer] else missing).append(row)
    if missing and not partial:
        raise missing[0].fault(f"{answer}: missing; --partial goes without missing trials")
    if plan:
        _check_trials(question, answered, plan, partial, notes)
    elif missing:
        notes.append(f"{question}: {len(missing)} trials have no answer")
    return answered


def _check_trials(
    question: str,
    rows: Sequence[CsvRow],
    plan: Mapping[tuple[str, int], CsvRow],
    partial: bool,
    notes: list[str],
) -> None:
    """Check that each trial of the plan is answered once, by everybody who has answered any."""
    seen: dict[tuple[str, int], list[CsvRow]] = {}
    people = {person for person, _ in plan}
    for row in rows:
        key = (row.text("person"), row.whole(TRIAL))
        if key[0] not in people:
            continue
        planned = plan.get(key)
        if planned is None:
            raise row.fault(f"trial: {key[0]} has no trial {key[1]} in the plan")
        for name in ("first", "second") if question in PAIRED else ():
            if row.cells[name] != planned.cells[name]:
                raise row.fault(
                    f"{name}: {row.cells[name]!r} is not the plan's {planned.cells[name]!r} of trial {key[1]}"
                )
        before = seen.setdefault(key, [])
        if before and (question != SORTS or any(one.cells["place"] == row.cells["place"] for one in before)):
            raise row.fault(
                f"trial: {key[1]} of {key[0]} is answered twice; row {before[0].line} is the first"
            )
        before.append(row)
    come = {person for person, _ in seen}
    gaps = [key for key in plan if key[0] in come and key not in seen]
    if gaps and not partial:
        person, trial = gaps[0]
        raise InputError(
            f"{rows[0].file}: trial: {len(gaps)} trials of the plan are missing, the first is {trial} of "
            f"{person}; --partial goes without them"
        )
    if gaps:
        notes.append(f"{question}: {len(gaps)} trials of the plan are missing")
    if waiting := len(people - come):
        notes.append(f"{question}: {waiting} people of the plan have not answered yet")


def _take(question: str, rows: Sequence[CsvRow], answers: Answers) -> None:
    """Add the answers of checked rows. Raises InputError."""
    if question == SORTS:
        answers.sorts += _sorts(rows)
    elif question == MAGNITUDES:
        answers.magnitudes += [
            Magnitude(row.text("person"), row.text("plate"), row.number("magnitude")) for row in rows
        ]
    else:
        pairs = [_pair(question, row) for row in rows]
        if question != SAME:
            _check_sides(question, pairs, rows)
        answers.pairs.setdefault(question, []).extend(pairs)


def _pair(question: str, row: CsvRow) -> JudgedPair:
    first, second, told = row.text("first"), row.text("second"), row.text(question)
    if first == second:
        raise row.fault(f"second: {second!r} is the first plate as well")
    allowed = (YES, NO) if question == SAME else (first, second)
    if told not in allowed:
        raise row.fault(f"{question}: {told!r} is neither {allowed[0]!r} nor {allowed[1]!r}")
    return JudgedPair(row.text("person"), first, second, told)


def _check_sides(question: str, pairs: Sequence[JudgedPair], rows: Sequence[CsvRow]) -> None:
    """Raise InputError for a person whose answers are all the first plate, or all the second."""
    sides: dict[str, list[bool]] = {}
    for pair in pairs:
        sides.setdefault(pair.person, []).append(pair.second_told)
    for person, seconds in sides.items():
        if len(seconds) >= LEAST_TO_JUDGE and len(set(seconds)) == 1:
            side = "second" if seconds[0] else "first"
            raise InputError(
                f"{rows[0].file}: {question}: {person} always answers the {side} plate, which tells nothing; "
                f"--without {person} leaves this person out"
            )


def _sorts(rows: Sequence[CsvRow]) -> list[Sort]:
    """Sorts from rows of a plate each. Raises InputError."""
    each: dict[tuple[str, str], list[CsvRow]] = {}
    for row in rows:
        each.setdefault((row.text("person"), row.text("sort")), []).append(row)
    sorts = []
    for (person, name), of_sort in each.items():
        places: dict[int, CsvRow] = {}
        for row in of_sort:
            if (place := row.whole("place")) in places:
                raise row.fault(f"place: {place} is there twice in the sort {name!r} of {person}")
            if any(row.cells["plate"] == other.cells["plate"] for other in places.values()):
                raise row.fault(
                    f"plate: {row.cells['plate']!r} is there twice in the sort {name!r} of {person}"
                )
            places[place] = row
        if len(places) < 2 or max(places) != len(places):
            raise of_sort[0].fault(f"place: the sort {name!r} of {person} has no places 1 to {len(places)}")
        sorts.append(Sort(person, tuple(places[place].cells["plate"] for place in sorted(places))))
    return sorts
