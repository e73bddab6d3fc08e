"""Tables of CSV from anywhere, read within limits; each fault is reported in one line with its row."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from relief.ground.errors import InputError
from relief.ground.files import read_limited

LARGEST_FILE = 1 << 24
"""Most bytes of a table: 200,000 answers, those of 500 people of 400 trials each."""
MOST_ROWS = 200_000
LONGEST_CELL = 300
"""Most characters of a cell that is read: more than a label or a name has."""


@dataclass(frozen=True)
class CsvRow:
    """A row of a table.

    Attributes:
        file: of the table.
        line: of the file, from 1 on.
        cells: stripped, by lower-case heading.
    """

    file: Path
    line: int
    cells: dict[str, str]

    def fault(self, text: str) -> InputError:
        """The error that names file and row."""
        return InputError(f"{self.file}: row {self.line}: {text}")

    def text(self, heading: str) -> str:
        """A cell that must not be empty. Raises InputError."""
        if not (cell := self.cells[heading]):
            raise self.fault(f"{heading}: missing")
        return cell

    def number(self, heading: str) -> float:
        """A cell that must be a positive number. Raises InputError."""
        text = self.text(heading)
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0.0 < value < math.inf:
            raise self.fault(f"{heading}: {text!r} is not a positive number")
        return value

    def whole(self, heading: str) -> int:
        """A cell that must be a whole number from 1 on. Raises InputError."""
        text = self.text(heading)
        if not (text.isascii() and text.isdecimal() and len(text) < 10 and int(text) > 0):
            raise self.fault(f"{heading}: {text!r} is not a whole number from 1 on")
        return int(text)


@dataclass(frozen=True)
class CsvTable:
    """A table.

    Attributes:
        file: as given.
        headings: in lower case.
        rows: without empty ones.
    """

    file: Path
    headings: tuple[str, ...]
    rows: tuple[CsvRow, ...]


def read_table(file: Path) -> CsvTable:
    """Read a table, with commas or, as spreadsheets of many countries write, semicolons.

    Raises:
        InputError: the file cannot be read, is no text in UTF-8, or no table.
    """
    content = read_limited(file, LARGEST_FILE)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no CSV table in UTF-8") from None
    if "\0" in text:
        raise InputError(f"{file}: is no CSV table: has zero bytes")
    first = text.partition("\n")[0]
    delimiter = ";" if first.count(";") > first.count(",") else ","
    lines = _lines(file, text, delimiter)
    headings = tuple(cell.lower() for cell in next(lines, (0, []))[1])
    if not any(headings):
        raise InputError(f"{file}: is empty; a first row of headings is expected")
    for heading in headings:
        if heading and headings.count(heading) > 1:
            raise InputError(f"{file}: has two columns {heading[:LONGEST_CELL]!r}")
    return CsvTable(file, headings, tuple(_rows(file, headings, lines)))


def _rows(file: Path, headings: Sequence[str], lines: Iterator[tuple[int, list[str]]]) -> Iterator[CsvRow]:
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
        yield CsvRow(file, line, dict(zip(headings, cells, strict=True)))


def _lines(file: Path, text: str, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Number of the last line of each row, and its cells."""
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(len(cell) > LONGEST_CELL for cell in stripped):
                raise InputError(
                    f"{file}: row {reader.line_num}: a cell is longer than {LONGEST_CELL} characters"
                )
            yield reader.line_num, stripped
    except csv.Error as error:
        raise InputError(f"{file}: row {reader.line_num}: is no CSV: {error}") from error
