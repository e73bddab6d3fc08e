"""Tables of CSV from anywhere, read within limits; each fault is reported in one line with its row."""

import codecs
import csv
import io
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from relief.ground.errors import InputError
from relief.ground.files import read_limited

LARGEST_FILE = 1 << 24
"""Most bytes of a table: 200,000 answers, those of 500 people of 400 trials each."""
MOST_ROWS = 200_000
LONGEST_CELL = 300
"""Most characters of a cell that is read: more than a label or a name has."""
NUMBER = re.compile(r"[+-]?([0-9]+([.,][0-9]*)?|[.,][0-9]+)(e[+-]?[0-9]+)?", re.IGNORECASE)
"""A number with a decimal point or, as spreadsheets of many countries write, a decimal comma."""
THOUSANDS = re.compile(r"[+-]?[1-9][0-9]{0,2},[0-9]{3}")
"""A number whose comma may stand before decimals or between thousands."""


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
        if not (text.isascii() and text.isdecimal() and len(text) < 10 and int(text) > 0):
            raise self.fault(f"{heading}: {text!r} is not a whole number from 1 on")
        return int(text)


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
        text = content.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no CSV table in UTF-8") from None
    if "\0" in text:
        raise InputError(f"{file}: is no CSV table: has zero bytes")
    first = re.sub('"[^"]*"', "", text.partition("\n")[0])
    lines = _lines(file, text, max(",;\t", key=first.count))
    columns = tuple(cell.lower() for cell in next(lines, (0, []))[1])
    if not any(columns):
        raise InputError(f"{file}: is empty; a first row of headings is expected")
    headings = tuple(names(columns))
    for heading, count in Counter(headings).items():
        if heading and count > 1:
            raise InputError(f"{file}: has two columns {heading[:LONGEST_CELL]!r}")
    return CsvTable(file, columns, headings, tuple(_rows(file, headings, lines)))


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
