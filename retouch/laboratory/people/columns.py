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
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from relief.ground.errors import InputError
from retouch.laboratory.people.tables import MOST_ROWS, CsvRow, CsvTable

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
MISSED = ("none", "null")
"""Cells, in lower case, by which PsychoPy and jsPsych say that a trial was shown and not answered."""
IMPORT_ID = '{"importid"'
"""Begin, in lower case, of a cell of the last of Qualtrics's three rows of headings."""
LONGEST_SORT = 3000
"""Most characters of a sort in one cell: 26 labels of 115."""
Plans = Mapping[str, Mapping[tuple[str, int], CsvRow]]
"""First row of each trial of a set's plan, by question, person and number."""


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
        for name in (*self.columns, *self.values):
            if not _own(name) or (name in self.values and name not in READ):
                argument = "columns" if name in self.columns else "values"
                raise InputError(f"{argument}: {name!r} is no column of answers: {', '.join(READ)}")
            if not self.columns.get(name, "any"):
                raise InputError(f"columns: {name}: the name of the column is empty")

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


def rows_by_question(table: CsvTable, mapped: ColumnMap, plans: Plans) -> tuple[dict[str, list[CsvRow]], int]:
    """The answers in a table, a row each with Retouch's headings and values, by question.

    Args:
        table: with Retouch's names of its columns.
        mapped: what stands for them; where columns are mapped, rows without plate or answer are no trials.
        plans: of the set.

    Returns:
        The rows, and how many rows of the table are no trials.

    Raises:
        InputError: the columns are those of no question, or of several without a map; no row is a trial.
    """
    rows: dict[str, list[CsvRow]] = {question: [] for question in _questions(table, mapped)}
    left_out = 0
    for row in _without_headings(table):
        found = [(name, one) for name in rows for one in _answers(name, row, bool(mapped.columns), plans)]
        left_out += not found
        for question, one in found:
            rows[question].append(_translated(question, one, mapped))
        if sum(map(len, rows.values())) > MOST_ROWS:
            raise InputError(f"{table.file}: has more than {MOST_ROWS} answers")
    if left_out and not any(rows.values()):
        raise InputError(f"{table.file}: has no answers; a plate or the answer is empty in each row")
    return rows, left_out


def _questions(table: CsvTable, mapped: ColumnMap) -> list[str]:
    """The questions that a table answers, by its headings. Raises InputError."""
    found = [name for name, headings in HEADINGS.items() if set(headings) <= set(table.headings)]
    if len(found) > 1 and not mapped.columns:
        raise InputError(f"{table.file}: columns of two questions: {', '.join(found)}; one file each, please")
    if "person" in table.headings:
        begins = {
            heading.partition(" ")[0] for heading in table.headings if " " in heading or heading == SORTS
        }
        found += [name for name, heading in OF_A_TRIAL.items() if heading in begins and name not in found]
    meant = {name.partition(" ")[0] for name in mapped.columns}
    if chosen := [name for name in found if meant & {ANSWER[name], OF_A_TRIAL[name]}] or found:
        return chosen
    kinds = "; ".join(", ".join(headings) for headings in HEADINGS.values())
    raise InputError(f"{table.file}: its columns are those of no answers: {kinds}")


def _without_headings(table: CsvTable) -> Sequence[CsvRow]:
    """Rows without the texts of questions and the identifiers that Qualtrics writes below the headings."""
    for count, row in enumerate(table.rows[:2], start=1):
        if any(cell.lower().startswith(IMPORT_ID) for cell in row.cells.values()):
            return table.rows[count:]
    return table.rows


def _answers(question: str, row: CsvRow, foreign: bool, plans: Plans) -> Iterator[CsvRow]:
    """The answers to a question in a row: none, one, or as many as the row has trials and sorted plates."""
    if set(HEADINGS[question]) <= row.cells.keys():
        if not foreign or _is_trial(question, row):
            yield row
        return
    for heading, cell in row.cells.items():
        name, _, number = heading.partition(" ")
        if name != OF_A_TRIAL[question] or cell.lower() in EMPTY:
            continue
        cells = {"sort": str(row.line), **row.cells}
        if number:
            planned = plans.get(question, {}).get((row.text("person"), int(number)))
            if planned is None:
                raise row.fault(f"{heading}: the plan has no trial {number} of {row.cells['person']!r}")
            cells = planned.cells
        of_trial = replace(row, cells=cells, column=heading if number else "")
        if question == SORTS:
            yield from _sorted(of_trial, cell)
        else:
            yield replace(of_trial, cells={**cells, name: cell})


def _is_trial(question: str, row: CsvRow) -> bool:
    """Whether a row of another program names an answer and a plate; instructions and pauses lack them."""
    plates = [row.cells[name] for name in ("first", "second", "plate") if name in HEADINGS[question]]
    return row.cells[ANSWER[question]].lower() not in EMPTY and any(
        one.lower() not in EMPTY for one in plates
    )


def _sorted(row: CsvRow, cell: str) -> Iterator[CsvRow]:
    """A row for each plate of a sort whose labels stand in one cell, with commas or semicolons."""
    if len(cell) > LONGEST_SORT:
        raise row.fault(f"{SORTS}: a cell is longer than {LONGEST_SORT} characters")
    for place, label in enumerate(re.split("[,;]", cell.strip("[]")), start=1):
        yield replace(row, cells={**row.cells, "place": str(place), "plate": label.strip(" '\"")})


def _translated(question: str, row: CsvRow, mapped: ColumnMap) -> CsvRow:
    """A row whose cells have the values that they stand for."""
    cells, answer = dict(row.cells), ANSWER[question]
    if mapped.columns and cells[answer].lower() in MISSED:
        cells[answer] = ""
    for name, meanings in mapped.values.items():
        if (cell := cells.get(name)) in meanings:
            cells[name] = meanings[cell]
    if answer in mapped.values and cells[answer] in ("first", "second"):
        cells[answer] = cells[cells[answer]]
    return replace(row, cells=cells)
