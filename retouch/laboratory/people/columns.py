"""Columns of tables of answers: those that are read, and what stands for them in tables of other programs.

The headings of a file say what it holds:

    person, first, second, rougher      label of the plate that was judged rougher (or `colder`)
    person, first, second, same         yes or no
    person, sort, place, plate          place of a plate in a sort, 1 for the smoothest
    person, sorts                       all labels of a sort, from the smoothest to the roughest
    person, plate, magnitude            a positive number

A column `trial` besides names the trial of the set's plan that a row answers. A table with one row a person
has a column for each trial of the plan, such as `rougher 12`.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from relief.ground.errors import InputError
from retouch.laboratory.people.tables import MOST_ROWS, CsvRow, CsvTable

ROUGHER, COLDER, SAME, SORTS, MAGNITUDES = "rougher", "colder", "same", "sorts", "magnitudes"
"""Questions of an experiment; the first three are also the headings of the answers."""
PAIRED = (ROUGHER, COLDER, SAME)
HEADINGS = {question: ("person", "first", "second", question) for question in PAIRED} | {
    SORTS: ("person", "sort", "place", "plate"),
    MAGNITUDES: ("person", "plate", "magnitude"),
}
"""Headings of the files of each question."""
TRIAL = "trial"
ANSWER = {question: "place" if question == SORTS else headings[-1] for question, headings in HEADINGS.items()}
"""Heading of the answer to each question."""
OF_A_TRIAL = ANSWER | {SORTS: SORTS}
"""Heading of a column that holds the whole answer to a trial, by question."""
NUMBERED = re.compile(rf"({'|'.join(OF_A_TRIAL.values())})[ _]?([0-9]{{1,9}})")
"""Heading of one trial in a table with one row a person; survey programs write `_` for a space."""
READ = dict.fromkeys((*(name for headings in HEADINGS.values() for name in headings), SORTS, TRIAL))
"""Headings that are read."""
EMPTY = ("", "na", "nan")
"""Cells, in lower case, of rows that are no trials; R and pandas write the words when they join files."""
MISSED = ("", "none", "null")
"""Cells, in lower case, of trials without an answer; PsychoPy and jsPsych write the words."""
IMPORT_ID = '{"importid"'
"""Begin, in lower case, of a cell of the last of Qualtrics's three rows of headings."""
MOST_SORTED = 99
"""Most labels of a sort in one cell, more than anybody sorts."""
Plan = Mapping[tuple[str, int], CsvRow]
"""First row of each trial of a question's plan, by person and number."""


@dataclass(frozen=True)
class ColumnMap:
    """What stands for Retouch's columns and values in tables of another program.

    Attributes:
        columns: the other program's name of a column, by Retouch's heading; `#` stands for the number of a
            trial.
        values: by Retouch's heading, what a cell means: a label, `yes` or `no`, or `first` or `second` for a
            plate of the pair; empty for no answer.

    Raises:
        InputError: a heading is none of Retouch's.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        wrong = [("columns", name) for name in self.columns if not _own(name)]
        wrong += [("values", name) for name in self.values if name not in READ]
        for argument, name in wrong:
            raise InputError(f"{argument}: {name!r} is no column of answers: {', '.join(READ)}")

    def names(self, headings: Sequence[str]) -> list[str]:
        """Retouch's names of the columns of a file, empty for columns that are not read.

        Args:
            headings: of the file, in lower case.
        """
        mapped = [self._mapped(heading) for heading in headings]
        # A conditions file made of the plan has Retouch's own columns beside those of the answers.
        own = ["" if (name := _own(heading)) in mapped else name for heading in headings]
        return [one or other for one, other in zip(mapped, own, strict=True)]

    def _mapped(self, heading: str) -> str:
        # A column that is named whole is not one of a pattern.
        for name, column in sorted(self.columns.items(), key=lambda one: "#" in one[1]):
            if found := _pattern(column).fullmatch(heading):
                return _own(" ".join((name, *found.groups())))
        return ""

    def meaning(self, name: str, cell: str) -> str:
        """What a cell means, by Retouch's heading of its column, which may end in the number of a trial."""
        return self.values.get(name.partition(" ")[0], {}).get(cell, cell)

    def check_found(self, tables: Sequence[CsvTable]) -> None:
        """Raise InputError for a column that no table has."""
        for name, column in self.columns.items():
            if not any(_pattern(column).fullmatch(one) for table in tables for one in table.columns):
                raise InputError(f"columns: {name}: {tables[0].file} has no column {column!r}")


def _own(heading: str) -> str:
    """Retouch's name of a heading; empty if it is none of Retouch's."""
    if numbered := NUMBERED.fullmatch(heading):
        return f"{numbered[1]} {int(numbered[2])}"
    return heading if heading in READ else ""


def _pattern(column: str) -> re.Pattern[str]:
    return re.compile(re.escape(column.lower()).replace(r"\#", "([0-9]{1,9})", 1))


def rows_by_question(
    table: CsvTable, mapped: ColumnMap, plans: Mapping[str, Plan]
) -> dict[str, list[CsvRow]]:
    """The answers in a table, a row each with Retouch's headings and values, by question.

    Args:
        table: with Retouch's names of its columns.
        mapped: what stands for them; where columns are mapped, rows without plate or answer are no trials.
        plans: of the set, by question.

    Raises:
        InputError: the columns are those of no question, or of several without a map; no row is a trial.
    """
    rows: dict[str, list[CsvRow]] = {question: [] for question in _questions(table, mapped)}
    for row in table.rows:
        translated = replace(
            row, cells={name: mapped.meaning(name, cell) for name, cell in row.cells.items()}
        )
        for question, found in rows.items():
            found += _answers(question, translated, bool(mapped.columns), plans.get(question, {}))
        if sum(map(len, rows.values())) > MOST_ROWS:
            raise InputError(f"{table.file}: has more than {MOST_ROWS} answers")
    if table.rows and not any(rows.values()):
        raise InputError(f"{table.file}: has no answers; each row lacks a plate or the answer")
    return rows


def _questions(table: CsvTable, mapped: ColumnMap) -> list[str]:
    """The questions that a table answers, by its headings. Raises InputError."""
    found = [name for name, headings in HEADINGS.items() if set(headings) <= set(table.headings)]
    if len(found) > 1 and not mapped.columns:
        raise InputError(f"{table.file}: columns of two questions: {', '.join(found)}; one file each, please")
    if "person" in table.headings:
        found += [name for name in HEADINGS if name not in found and _of_trials(name, table.headings)]
    meant = {name.partition(" ")[0] for name in mapped.columns}
    if chosen := [name for name in found if meant & {ANSWER[name], OF_A_TRIAL[name]}] or found:
        return chosen
    kinds = "; ".join(", ".join(headings) for headings in HEADINGS.values())
    raise InputError(f"{table.file}: its columns are those of no answers: {kinds}")


def _of_trials(question: str, headings: Iterable[str]) -> list[str]:
    """The columns that hold whole answers to a question, with the number of a trial or as a sort."""
    begin = f"{OF_A_TRIAL[question]} "
    return [heading for heading in headings if heading.startswith(begin) or heading == question == SORTS]


def without_headings(table: CsvTable) -> CsvTable:
    """A table without the texts of questions and the identifiers that Qualtrics writes below the headings."""
    for count, row in enumerate(table.rows[:2], start=1):
        if any(cell.lower().startswith(IMPORT_ID) for cell in row.cells.values()):
            return replace(table, rows=table.rows[count:])
    return table


def _answers(question: str, row: CsvRow, foreign: bool, plan: Plan) -> Iterator[CsvRow]:
    """The answers to a question in a row: none, one, or as many as the row has trials and sorted plates."""
    if set(HEADINGS[question]) <= row.cells.keys():
        filled = {name for name in HEADINGS[question] if row.cells[name].lower() not in EMPTY}
        if not foreign or (ANSWER[question] in filled and filled & {"first", "second", "plate"}):
            yield row
        return
    for heading in _of_trials(question, row.cells):
        name, _, number = heading.partition(" ")
        cells = {"sort": str(row.line), **row.cells}
        if number:
            person, none = row.cells["person"], dict.fromkeys(HEADINGS[question], "")
            planned = plan.get((person, int(number)))
            cells = (planned.cells if planned else none) | {"person": person, TRIAL: number}
        of_trial = replace(
            row, cells=cells | {name: row.cells[heading]}, column=f"{heading}: " * bool(number)
        )
        if row.cells[heading].lower() not in EMPTY:
            yield from _sorted(of_trial) if question == SORTS else (of_trial,)


def _sorted(row: CsvRow) -> Iterator[CsvRow]:
    """A row for each plate of a sort whose labels stand in one cell, with commas or semicolons."""
    labels = re.split("[,;]", row.cells[SORTS].strip("[]"), maxsplit=MOST_SORTED)
    for place, label in enumerate(labels, start=1):
        yield replace(row, cells=row.cells | {"place": str(place), "plate": label.strip(" '\"")})
