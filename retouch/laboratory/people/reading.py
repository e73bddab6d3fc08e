"""Answers of people: pairs, sorts and magnitudes, checked against the set and its plan."""

import itertools
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from relief.ground.errors import InputError
from retouch.laboratory.people.plates import SetPlate, labels_of
from retouch.laboratory.people.tables import (
    ANSWER,
    MAGNITUDES,
    MISSED,
    PLATES,
    ROUGHER,
    SAME,
    SORTS,
    THOUSANDS,
    TRIAL,
    ColumnMap,
    CsvRow,
    CsvTable,
    Plan,
    grouped,
    read_table,
    rows_by_question,
)
from retouch.laboratory.people.tables import COLDER as COLDER
from retouch.laboratory.people.tables import HEADINGS as HEADINGS
from tactile.jnd import SMOOTH_BELOW, smooth_clause

YES, NO = "yes", "no"
MOST_PEOPLE = 300
"""Most people of an experiment: their likelihoods take 0.5 MB each."""
LEAST_TO_COMPARE = 20
"""Answers from which on the same ones, there twice, are taken for a copy."""
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


def read_answers(
    files: Sequence[Path],
    plates: Mapping[str, SetPlate],
    plans: Mapping[str, Plan],
    partial: bool,
    without: Sequence[str] = (),
    mapped: ColumnMap | None = None,
) -> Answers:
    """Read the answers to a set.

    Args:
        files: tables; several may answer one question.
        plates: of the set, by label.
        plans: by question, the first row of each trial of the set's plan by person and number; empty without.
        partial: whether people may have left trials of the plan out.
        without: people to leave out.
        mapped: what stands for the columns and values in the files; None: they have those of Retouch.

    Raises:
        InputError: a table is there twice; a label is none of the set's; a trial is missing, double, or
            another than the plan's; a person always answers the same.
    """
    answers, mapped = Answers(), mapped or ColumnMap()
    by_question: dict[str, list[CsvRow]] = {}
    left_out = 0
    for table in _tables(files, mapped):
        rows_of = rows_by_question(table, mapped, plans)
        for question, rows in rows_of.items():
            by_question.setdefault(question, []).extend(rows)
        left_out += len(table.rows) - len({row.line for rows in rows_of.values() for row in rows})
    if left_out:
        answers.notes.append(
            f"{left_out} rows of the files are no answers: a plate, trial or answer is empty"
        )
    known = {row.text("person") for rows in by_question.values() for row in rows}
    labels = labels_of(plates)
    for question, each in by_question.items():
        for row in each:
            named = (*PLATES[question], ANSWER[question])
            row.cells.update({name: labels.get(row.cells[name].upper(), row.cells[name]) for name in named})
        rows = [row for row in each if row.cells["person"] not in without]
        rows = _answered(question, rows, plans.get(question, {}), partial, answers.notes)
        _check_labels(question, rows, plates)
        _take(question, rows, answers)
    if unknown := set(without) - known:
        raise InputError(f"without: nobody is called {min(unknown)!r}")
    if len(known) > MOST_PEOPLE:
        raise InputError(f"{files[0]}: answers of more than {MOST_PEOPLE} people")
    if not (any(answers.pairs.values()) or answers.sorts or answers.magnitudes):
        raise InputError(f"{files[0]}: has no answers")
    return answers


def _tables(files: Sequence[Path], mapped: ColumnMap) -> list[CsvTable]:
    """Tables of files that are all different, long ones not by their order alone. Raises InputError."""
    tables: dict[object, CsvTable] = {}
    for file in files:
        table = read_table(file, mapped.names)
        rows = [tuple(sorted(row.cells.items())) for row in table.rows]
        if len(rows) >= LEAST_TO_COMPARE:
            rows.sort()
        if (same := tables.setdefault(tuple(rows), table)) is not table:
            raise InputError(f"{file}: is the same table as {same.file}, whose answers would count twice")
    mapped.check_found(list(tables.values()))
    return list(tables.values())


def _check_labels(question: str, rows: Sequence[CsvRow], plates: Mapping[str, SetPlate]) -> None:
    for row in rows:
        for name in PLATES[question]:
            if row.text(name) not in plates:
                raise row.fault(f"{name}: {row.cells[name]!r} is no plate of this set")
            roughness = plates[row.text(name)].roughness
            if question in (SORTS, ROUGHER) and roughness < SMOOTH_BELOW:
                raise row.fault(f"{name}: {row.cells[name]!r} is {smooth_clause(roughness)}")


def _answered(
    question: str, rows: Sequence[CsvRow], plan: Plan, partial: bool, notes: list[str]
) -> list[CsvRow]:
    """Rows with an answer, checked against the plan. Raises InputError."""
    answer, planned = ANSWER[question], {person for person, _ in plan}
    missing = [row for row in rows if row.cells[answer].lower() in MISSED]
    if missing and not partial:
        raise missing[0].fault(f"{answer}: missing; --partial goes without missing trials")
    answered = [row for row in rows if row.cells[answer].lower() not in MISSED]
    trials = _trials(question, answered, plan)
    _check_complete(question, trials, plan, partial, notes)
    _check_copies(question, answered, notes)
    people = {person for person, _ in trials}
    for row in answered:
        if TRIAL not in row.cells and (person := row.text("person")) in people:
            raise row.fault(f"trial: missing; other answers of {person} name the trials of the plan")
    if alone := sum(TRIAL not in row.cells or row.cells["person"] not in planned for row in missing):
        notes.append(f"{question}: {alone} trials have no answer")
    if unchecked := {row.cells["person"] for row in answered if plan} - (people & planned):
        text = f"{len(unchecked)} people name no trials of the plan; their answers are not checked against it"
        notes.append(f"{question}: {text}")
    return answered


def _trials(question: str, rows: Sequence[CsvRow], plan: Plan) -> dict[tuple[str, int], list[CsvRow]]:
    """Rows that name a trial, by person and trial: each as planned, and answered once. Raises InputError."""
    trials: dict[tuple[str, int], list[CsvRow]] = {}
    planned = {person for person, _ in plan}
    for row in (one for one in rows if TRIAL in one.cells):
        key = (row.text("person"), row.whole(TRIAL))
        if key[0] in planned or row.column:
            _check_planned(question, row, key, plan)
        before = trials.setdefault(key, [])
        if before and (question != SORTS or any(one.cells["place"] == row.cells["place"] for one in before)):
            of_file = f" of {before[0].file}" * (before[0].file != row.file)
            raise row.fault(
                f"trial: {key[1]} of {key[0]} is answered twice; row {before[0].line}{of_file} is the first"
            )
        before.append(row)
    return trials


def _check_planned(question: str, row: CsvRow, key: tuple[str, int], plan: Plan) -> None:
    """Raise InputError for a row whose trial the plan does not have, or has with other plates."""
    if (planned := plan.get(key)) is None:
        raise row.fault(f"trial: {key[0]} has no trial {key[1]} in the plan")
    for name, label in zip(PLATES[question], planned, strict=question != SORTS):
        if (plate := row.text(name)) != label and (question != SORTS or plate not in planned):
            of_plan = " or ".join(map(repr, planned if question == SORTS else (label,)))
            raise row.fault(f"{name}: {plate!r} is not the plan's {of_plan} of trial {key[1]}")


def _check_complete(
    question: str, trials: Mapping[tuple[str, int], list[CsvRow]], plan: Plan, partial: bool, notes: list[str]
) -> None:
    """Check that everybody of the plan who has answered any trial has answered all. Raises InputError."""
    come = {person: rows[0].file for (person, _), rows in trials.items()}
    least = {key: len(plates) if question == SORTS else 1 for key, plates in plan.items()}
    gaps = [key for key in plan if key[0] in come and len(trials.get(key, ())) < least[key]]
    if gaps and not partial:
        person, trial = gaps[0]
        raise InputError(
            f"{come[person]}: trial: {len(gaps)} trials of the plan are missing, the first is {trial} of "
            f"{person}; --partial goes without them"
        )
    if gaps:
        notes.append(f"{question}: {len(gaps)} trials of the plan are missing")
    if come and (waiting := len({person for person, _ in plan} - come.keys())):
        notes.append(f"{question}: {waiting} people of the plan have not answered yet")


def _check_copies(question: str, rows: Sequence[CsvRow], notes: list[str]) -> None:
    """Refuse a person's answers that are there twice, in any order, and note those of several people.

    People may sort plates or judge looks twice alike, and may answer a trial again that has another number.

    Raises:
        InputError: all answers of a person in one file, without trials, are there again.
    """
    if question in (SAME, SORTS):
        return
    names = (*PLATES[question], ANSWER[question])
    each = grouped(
        ((row.text("person"), row.file, TRIAL in row.cells), tuple(row.cells[name] for name in names))
        for row in rows
    )
    judged = {key: Counter(answers) for key, answers in each.items() if len(answers) >= LEAST_TO_COMPARE}
    same = [pair for pair in itertools.permutations(judged, 2) if judged[pair[0]] <= judged[pair[1]]]
    for key, answers in each.items():
        middle = len(answers) // 2
        if middle >= LEAST_TO_COMPARE and answers[:middle] == answers[middle:]:
            same.append((key, key))
    for (person, file, named), (other, again, _) in same:
        if person == other and not named:
            raise InputError(
                f"{file}: {question}: {person}'s answers are in {again} again, and would count twice; "
                "if they were given twice, number them in a column trial"
            )
    if copies := {one[0]: other[0] for one, other in same if one[0] != other[0]}:
        person, other = next(iter(copies.items()))
        alike = f"{len(copies)} people's answers are all among those of another person"
        notes.append(f"{question}: {alike}, as {person}'s among {other}'s; are these copies?")


def _take(question: str, rows: Sequence[CsvRow], answers: Answers) -> None:
    """Add the answers of checked rows. Raises InputError."""
    if question == SORTS:
        answers.sorts += _sorts(rows)
    elif question == MAGNITUDES:
        _check_marks(rows)
        answers.magnitudes += [
            Magnitude(row.text("person"), row.text("plate"), row.number("magnitude")) for row in rows
        ]
    else:
        pairs = [_pair(question, row) for row in rows]
        if question != SAME:
            _check_sides(question, pairs, rows)
        answers.pairs.setdefault(question, []).extend(pairs)


def _check_marks(rows: Sequence[CsvRow]) -> None:
    """Raise InputError for a point that may stand between thousands, beside numbers with decimal commas."""
    commas = {row.file for row in rows if "," in row.cells["magnitude"]}
    for row in rows:
        if row.file in commas and THOUSANDS.fullmatch(row.cells["magnitude"].replace(".", ",")):
            raise row.fault(f"magnitude: {row.cells['magnitude']!r} may have decimals or thousands")


def _pair(question: str, row: CsvRow) -> JudgedPair:
    first, second, told = row.text("first"), row.text("second"), row.text(question)
    if first == second:
        raise row.fault(f"second: {second!r} is the first plate as well")
    allowed = (YES, NO) if question == SAME else (first, second)
    if question != SAME and told not in allowed:
        told = {"first": first, "second": second}.get(told, told)
    if told not in allowed:
        raise row.fault(f"{question}: {told!r} is neither {allowed[0]!r} nor {allowed[1]!r}")
    return JudgedPair(row.text("person"), first, second, told)


def _check_sides(question: str, pairs: Sequence[JudgedPair], rows: Sequence[CsvRow]) -> None:
    """Raise InputError for a person whose answers are all the first plate, or all the second."""
    for person, seconds in grouped((pair.person, pair.second_told) for pair in pairs).items():
        if len(seconds) >= LEAST_TO_JUDGE and len(set(seconds)) == 1:
            side = "second" if seconds[0] else "first"
            file = next(row.file for row in rows if row.cells["person"] == person)
            raise InputError(
                f"{file}: {question}: {person} always answers the {side} plate, which tells nothing; "
                f"--without {person} leaves this person out"
            )


def _sorts(rows: Sequence[CsvRow]) -> list[Sort]:
    """Sorts from rows of a plate each. Raises InputError."""
    sorts = []
    each = grouped(((row.text("person"), row.text("sort")), row) for row in rows)
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
