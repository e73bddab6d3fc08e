"""Tables of CSV from anywhere, read within limits, and the answers in them; a fault is one line with its row.

The headings of a file say what it holds:

    person, first, second, rougher      label of the plate that was judged rougher (or `colder`)
    person, first, second, same         yes or no
    person, sort, place, plate          place of a plate in a sort, 1 for the smoothest
    person, sorts                       all labels of a sort, from the smoothest to the roughest
    person, plate, magnitude            a positive number

A column `trial` besides names the trial of the set's plan that a row answers. A table with one row a person
has a column for each trial of the plan, such as `rougher 12`.
"""

import codecs
import csv
import io
import itertools
import math
import re
import unicodedata
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypeVar

from relief.ground.errors import InputError
from relief.ground.files import read_limited

LARGEST_FILE = 1 << 24
"""Most bytes of a table: 200,000 answers, those of 500 people of 400 trials each."""
MOST_ROWS = 200_000
MOST_COLUMNS = 20_000
"""Most columns of a table; surveys have some for each question."""
LONGEST_CELL = 300
"""Most characters of a cell that is read: more than a label or a name has."""
NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)(e[+-]?[0-9]+)?", re.IGNORECASE)
"""A number with a decimal point or, as spreadsheets of many countries write, a decimal comma."""
WHOLE = re.compile(r"([0-9]{1,9})([.,]00?)?")
"""A whole number, or one as pandas (1.0) and SPSS (1,00) write it beside empty cells."""
THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
"""A number whose comma may stand before decimals or between thousands."""
ROUGHER, COLDER, SAME, SORTS, MAGNITUDES = "rougher", "colder", "same", "sorts", "magnitudes"
"""Questions of an experiment; the first three are also the headings of the answers."""
PAIRED = (ROUGHER, COLDER, SAME)
HEADINGS = {question: ("person", "first", "second", question) for question in PAIRED} | {
    SORTS: ("person", "sort", "place", "plate"),
    MAGNITUDES: ("person", "plate", "magnitude"),
}
"""Headings of the files of each question."""
PLATES = {
    question: tuple(name for name in headings if name in ("first", "second", "plate"))
    for question, headings in HEADINGS.items()
}
"""Headings of the plates, by question."""
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
MISSED = (*EMPTY, "none", "null")
"""Cells, in lower case, of trials without an answer; PsychoPy and jsPsych write the other words."""
IMPORT_ID = '{"importid"'
"""Begin, in lower case, of a cell of the last of Qualtrics's three rows of headings."""
MOST_SORTED = 99
"""Most labels of a sort in one cell, more than anybody sorts."""


K = TypeVar("K")
V = TypeVar("V")


def grouped(pairs: Iterable[tuple[K, V]]) -> dict[K, list[V]]:
    """Values by key, both in the order of the pairs."""
    groups: dict[K, list[V]] = {}
    for key, value in pairs:
        groups.setdefault(key, []).append(value)
    return groups


@dataclass(frozen=True)
class CsvRow:
    """A row of a table.

    Attributes:
        file: of the table.
        line: of the file, from 1 on.
        cells: stripped, by lower-case heading.
        column: begin of a fault's text that names the column, where the row of the file has several answers.
    """

    file: Path
    line: int
    cells: dict[str, str]
    column: str = ""

    def fault(self, text: str) -> InputError:
        """The error that names file and row."""
        return InputError(f"{self.file}: row {self.line}: {self.column}{text}")

    def text(self, heading: str) -> str:
        """A cell that must not be empty. Raises InputError."""
        if not (cell := self.cells[heading]):
            raise self.fault(f"{heading}: missing")
        if len(cell) > LONGEST_CELL:
            raise self.fault(f"{heading}: a cell is longer than {LONGEST_CELL} characters")
        return cell

    def number(self, heading: str) -> float:
        """A cell that must be a positive number, with a decimal point or comma. Raises InputError."""
        text = self.text(heading)
        if THOUSANDS.fullmatch(text):
            raise self.fault(f"{heading}: {text!r} may have decimals or thousands; write it without a comma")
        value = float(text.replace(",", ".")) if NUMBER.fullmatch(text) else math.nan
        if not 0.0 < value < math.inf:
            raise self.fault(f"{heading}: {text!r} is not a positive number")
        return value

    def whole(self, heading: str) -> int:
        """A cell that must be a whole number from 1 on. Raises InputError."""
        text = self.text(heading)
        if not (found := WHOLE.fullmatch(text)) or int(found[1]) < 1:
            raise self.fault(f"{heading}: {text!r} is not a whole number from 1 on")
        return int(found[1])


@dataclass(frozen=True)
class CsvTable:
    """A table.

    Attributes:
        file: as given.
        columns: headings of the file, in lower case.
        headings: names of the columns; empty for a column that is not read.
        rows: without empty ones.
    """

    file: Path
    columns: tuple[str, ...]
    headings: tuple[str, ...]
    rows: tuple[CsvRow, ...]


def read_table(file: Path, names: Callable[[Sequence[str]], Sequence[str]] = tuple) -> CsvTable:
    """Read a table, with commas or, as spreadsheets of many countries write, semicolons, or tabs.

    Args:
        file: in UTF-8, or in UTF-16 with its mark, as spreadsheets and Qualtrics write tables with tabs.
        names: from headings in lower case to the names under which their cells are read, empty for none.

    Raises:
        InputError: the file cannot be read, is no text in UTF-8, or no table.
    """
    content = read_limited(file, LARGEST_FILE)
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    try:
        # One name may be written with combined letters or with single ones, as macOS does.
        text = unicodedata.normalize("NFC", content.decode("utf-16" if wide else "utf-8-sig"))
    except UnicodeDecodeError as error:
        row = len(content[: error.start + 1].splitlines())
        raise InputError(f"{file}: row {row}: is no CSV table in UTF-8; save it as one") from None
    if "\0" in text:
        raise InputError(f"{file}: is no CSV table: has zero bytes")
    first = re.sub('"[^"]*"', "", text.partition("\n")[0])
    lines = _lines(file, text, max(",;\t", key=first.count))
    columns = tuple(cell.lower() for cell in next(lines, (0, []))[1][: MOST_COLUMNS + 1])
    if len(columns) > MOST_COLUMNS:
        raise InputError(f"{file}: has more than {MOST_COLUMNS} columns")
    if not any(columns):
        raise InputError(f"{file}: is empty; a first row of headings is expected")
    headings = tuple(names(columns))
    for heading, count in Counter(headings).items():
        if heading and count > 1:
            raise InputError(f"{file}: has two columns {heading[:LONGEST_CELL]!r}")
    return CsvTable(file, columns, headings, _without_headings(tuple(_rows(file, columns, headings, lines))))


def _without_headings(rows: tuple[CsvRow, ...]) -> tuple[CsvRow, ...]:
    """Rows without the texts of questions and the identifiers that Qualtrics writes below the headings."""
    for count, row in enumerate(rows[:2], start=1):
        if any(cell.lower().startswith(IMPORT_ID) for cell in row.cells.values()):
            return rows[count:]
    return rows


def _rows(
    file: Path, columns: Sequence[str], headings: Sequence[str], lines: Iterator[tuple[int, list[str]]]
) -> Iterator[CsvRow]:
    count = 0
    for line, cells in lines:
        if not any(cells):
            continue
        if (count := count + 1) > MOST_ROWS:
            raise InputError(f"{file}: has more than {MOST_ROWS} rows")
        if len(cells) != len(headings):
            raise InputError(
                f"{file}: row {line}: has {len(cells)} cells, and the table {len(headings)} columns"
            )
        if cells[-1] and not columns[-1]:
            # As the second half of a number with a decimal comma, where commas separate the cells.
            raise InputError(f"{file}: row {line}: {cells[-1][:LONGEST_CELL]!r} stands under no heading")
        yield CsvRow(file, line, {name: cell for name, cell in zip(headings, cells, strict=True) if name})


def _lines(file: Path, text: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Number of the last line of each row, and its cells."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    # Pictures and recordings may stand in cells; the limit is one of the process.
    limit = csv.field_size_limit(LARGEST_FILE)
    try:
        for cells in reader:
            yield reader.line_num, [cell.strip() for cell in cells]
    except csv.Error as error:
        raise InputError(f"{file}: row {reader.line_num}: is no CSV: {error}") from error
    finally:
        csv.field_size_limit(limit)


Plan = Mapping[tuple[str, int], tuple[str, ...]]
"""Labels of the plates of each trial of a question's plan, by person and number."""


@dataclass(frozen=True)
class ColumnMap:
    """What stands for Retouch's columns and values in tables of another program.

    Attributes:
        columns: the other program's name of a column, by Retouch's heading; `#` stands for the number of a
            trial.
        values: by Retouch's heading, what a cell means: a label, `yes` or `no`, or `first` or `second` for a
            plate of the pair; empty for no answer.

    Raises:
        InputError: a heading is none of Retouch's; two headings stand for one column.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        wrong = [("columns", name) for name in self.columns if not _own(name)]
        wrong += [("values", name) for name in self.values if name not in READ]
        for argument, name in wrong:
            raise InputError(f"{argument}: {name!r} is no column of answers: {', '.join(READ)}")
        for column, count in Counter(column.lower() for column in self.columns.values()).items():
            if count > 1:
                raise InputError(f"columns: {column!r} cannot stand for two columns of answers")

    def names(self, headings: Sequence[str]) -> list[str]:
        """Retouch's names of the columns of a file, empty for columns that are not read.

        Args:
            headings: of the file, in lower case.
        """
        mapped = [self._mapped(heading) for heading in headings]
        # A conditions file made of the plan has Retouch's own columns beside those of the answers.
        taken = set(mapped)
        own = ["" if (name := _own(heading)) in taken else name for heading in headings]
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
        mapped: what stands for them; where columns are mapped, rows without a plate, an answer or, if there
            are trials, a trial are left out.
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
            answers = _answers(question, translated, bool(mapped.columns), plans.get(question, {}))
            found += itertools.islice(answers, MOST_ROWS)
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


def _answers(question: str, row: CsvRow, foreign: bool, plan: Plan) -> Iterator[CsvRow]:
    """The answers to a question in a row: none, one, or as many as the row has trials and sorted plates."""
    if set(HEADINGS[question]) <= row.cells.keys():
        filled = {name for name, cell in row.cells.items() if cell.lower() not in EMPTY}
        needed = {ANSWER[question], TRIAL} & row.cells.keys()
        if not foreign or (needed <= filled and filled & {"first", "second", "plate"}):
            yield row
        return
    for heading in _of_trials(question, row.cells):
        name, _, number = heading.partition(" ")
        cells = {"sort": f"{row.file}, row {row.line}", **row.cells}
        if number:
            person = row.cells["person"]
            planned = plan.get((person, int(number)), itertools.repeat(""))
            plates = dict(zip(PLATES[question], planned, strict=False))
            cells = plates | {"person": person, TRIAL: number, "sort": f"trial {number}"}
        cells = {**cells, name: row.cells[heading]}
        of_trial = replace(row, cells=cells, column=f"{heading}: " * bool(number))
        if cells[name].lower() not in EMPTY:
            yield from _sorted(of_trial) if question == SORTS else (of_trial,)


def _sorted(row: CsvRow) -> Iterator[CsvRow]:
    """A row for each plate of a sort whose labels stand in one cell, with commas or semicolons."""
    labels = re.split("[,;]", row.cells[SORTS].strip("[],; "), maxsplit=MOST_SORTED)
    for place, label in enumerate(labels, start=1):
        yield replace(row, cells=row.cells | {"place": str(place), "plate": label.strip(" '\"")})
