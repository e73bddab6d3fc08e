"""Texts of numbers: ESRI's .asc, tables of heights with a row in each line, and points x, y, z."""

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.files import damage_named, read_limited
from relief.reading.samples import LONGEST_SIDE, Check, Samples, check_extent, check_square, measured

LARGEST_TEXT = 1 << 28
"""Most bytes of a text: 4096 x 4096 numbers of 16 characters."""
WORDS_BYTES = 1 << 20
"""Bytes below a line in which its words may be again: holes."""
MOST_HEADINGS = 40
"""Most lines with content among which the first row must be: names and units, or 20 lines of settings of an
instrument, may be above."""
UNEVEN = 0.05
"""Largest deviation of evenly spaced coordinates, in their range, if this is less than a step: 0.0125, 0.025
and 0.0375 may be rounded to 0.01, 0.03 and 0.04."""
OWN = 0.5
"""Least range of the differences of coordinates from the heights beside them, in ranges of the coordinates:
the rows of a tilted plane are even as well, but differ from each other by a constant."""
_HEADING = re.compile(rb"\s*(ncols|nrows|xll\w+|yll\w+|cellsize|dx|dy|nodata\w*)[ \t]+(\S+)[ \t]*\n", re.I)
"""Line of the heading of an ESRI grid."""
_COMMENT = re.compile(rb"(?m)^ *(?:#(?!N/[AD]|NV\b|[A-Z]+(?:/0)?[!?])[^\n]*)?$")
"""Line of spaces or a comment; #N/A and the like are holes in tables of spreadsheets."""
_NUMBER = re.compile(rb"[-+]?(\d+[.,]?\d*|[.,]\d+)(e[-+]?\d+)?", re.I)
_WORDS = rb"n/?[ad]|n\.a\.|[-+]?(nan|inf|infinity)|bad|none|null|no ?data|masked|missing|.*#.*"
_HOLE = re.compile(rb"[^\w.]*|" + _WORDS, re.I)
"""Word on a first line that stands for a number that was not measured; other words are a heading."""
_UNIT = re.compile(rb"\[[^]\n]*\]|\([^)\n]*\)")
"""Unit in brackets behind the name of a column."""
_SIGNS = re.compile(rb"[\s,;\"#/%!]+")
"""Signs before, between and behind names of columns."""
AXES = (b"x", b"y", b"z")
_AXIS = re.compile(rb"[xyz](?:_.*)?")
"""Name of a column of points, perhaps with a unit behind."""


def read_grid(path: Path, check: Check) -> Samples:
    """Read a grid of heights; a row and a column of coordinates are left out, with a note.

    Raises InputError, also for points x, y, z and for profiles.
    """
    with damage_named(path, "a table of numbers"):
        text = _COMMENT.sub(b"", _content(path))
        heading: dict[str, float] = {}
        start = 0
        while found := _HEADING.match(text, start):
            heading[found[1].decode().lower().split("_")[0]] = float(found[2].replace(b",", b"."))
            start = found.end()
        values, notes = _esri(text[start:], heading, path, check) if heading else _table(text, path)
    check(values.shape, path)
    check_square(heading.get("dx", 1.0), heading.get("dy", 1.0), path)
    no_data = heading.get("nodata", -9999.0) if heading else None
    kind = "ESRI grid" if heading else "table"
    return Samples(path, f"{kind} of numbers", {"Y": measured(values, no_data)}, notes=notes)


def read_points(path: Path, most_columns: int) -> Array | None:
    """Read points, one in a line: (n, 3) x, y and z, NaN where nothing was measured.

    The first three columns are read, or those that a line of headings names. None for more columns than
    `most_columns`, which are a table of heights. Raises InputError.
    """
    with damage_named(path, "lines of x, y and z"):
        content = _content(path)
        text, delimiter, width = _delimited(_COMMENT.sub(b"", content))
        if width > most_columns:
            return None
        # Three numbers are a point, also beside a label of its own.
        rows = _rows(text, delimiter, width, path, enough=3)[0]
        above = text.count(b"\n") - rows.count(b"\n")
        columns = _columns(content.split(b"\n", above)[:above], width)
        values = _numbers(rows, delimiter, above, usecols=columns)
    values[:, 2] = measured(values[:, 2])
    return values


def _columns(headings: list[bytes], width: int) -> list[int]:
    """Columns of x, y and z by the last line above the points that names them; else the first three."""
    for line in reversed(headings):
        names = _SIGNS.split(_SIGNS.sub(b" ", _UNIT.sub(b"", line).lower()).strip())
        axes = [name[:1] if _AXIS.fullmatch(name) else b"" for name in names]
        if len(axes) == width and all(axes.count(axis) == 1 for axis in AXES):
            return [axes.index(axis) for axis in AXES]
    return [0, 1, 2]


def _content(path: Path) -> bytes:
    """The text of a file in UTF-8 or of one byte a sign; a line feed ends each line. Raises InputError."""
    content = read_limited(path, LARGEST_TEXT)
    if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        content = content.decode("utf-16").encode()
    if b"\0" in content:
        raise InputError(f"{path}: is no text of numbers")
    content = content.removeprefix(BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n") + b"\n"
    return content.replace("\N{MINUS SIGN}".encode(), b"-")


def _esri(text: bytes, heading: dict[str, float], path: Path, check: Check) -> tuple[Array, tuple[str, ...]]:
    """(nrows, ncols) numbers of a grid whose lines may end anywhere, and no notes."""
    rows, cols = int(heading.get("nrows", 0)), int(heading.get("ncols", 0))
    check((rows, cols), path)
    text, delimiter, _ = _delimited(text)
    one_a_line = text.translate(bytes.maketrans(b" \t" + (delimiter or b" "), b"\n\n\n"))
    values = _numbers(one_a_line, None, max_rows=rows * cols + 1)
    if values.size != rows * cols:
        raise InputError(f"{path}: its heading says {cols} x {rows} numbers; the file holds more or fewer")
    return values.reshape(rows, cols), ()


def _table(text: bytes, path: Path) -> tuple[Array, tuple[str, ...]]:
    """(rows, cols) heights with a row in each line, and notes."""
    text, delimiter, width = _delimited(text)
    heights, corner, notes = _rows(text, delimiter, width, path, enough=width)
    above = text.count(b"\n") - heights.count(b"\n")
    values = _numbers(heights, delimiter, above, max_rows=LONGEST_SIDE + 1)
    # A delimiter at the end of each line separates nothing.
    if delimiter and np.isnan(values[:, -1]).all() and heights.count(delimiter + b"\n") >= len(values):
        values = values[:, :-1]
    if values.shape[1] <= 3:
        kind = "points x, y, z" if values.shape[1] == 3 else "a profile or points"
        raise InputError(f"{path}: holds {kind}, not a grid; `retouch scan` reads points")
    # Without a word, coordinates differ from heights if they are on two sides, or count.
    both = _is_axis(values[:2, 1:], whole=False) and _is_axis(values[1:, :2].T, whole=False)
    row = both or _is_axis(values[:2, corner:], whole=not corner)
    column = both or _is_axis(values[corner:, :2].T, whole=not corner and heights == text.lstrip(b"\n"))
    if row or column:
        notes += (f"left out: {' and '.join(['a row'] * row + ['a column'] * column)} of coordinates",)
    return values[int(row) :, int(column) :], notes


def _rows(
    text: bytes, delimiter: bytes | None, width: int, path: Path, enough: int
) -> tuple[bytes, int, tuple[str, ...]]:
    """The rows of a table; 1 if their corner is empty or a word; and a note if headings held numbers.

    Args:
        text, delimiter, width: of `_delimited`.
        path: of the file, for messages.
        enough: numbers that make a line a row, whatever stands beside.
    """
    notes: tuple[str, ...] = ()
    for _line in range(MOST_HEADINGS):
        text = text.lstrip(b"\n")
        first, _, rest = text.partition(b"\n")
        cells = [cell.strip(b' "') for cell in first.split(delimiter, LONGEST_SIDE + 1)]
        check_extent((1, len(cells)), path)
        numbers = sum(_NUMBER.fullmatch(cell) is not None for cell in cells)
        words = {cell for cell in cells if not _NUMBER.fullmatch(cell) and not _HOLE.fullmatch(cell)}
        if words and len(cells) == width:
            # Words that are in rows below as well stand for holes.
            below = rest[:WORDS_BYTES].replace(b"\n", delimiter or b"\n").split(delimiter)
            words.difference_update(cell.strip(b' "') for cell in below)
        named = words == {cells[0]} and 2 * numbers >= len(cells) == width
        # A number alone is that of the rows.
        if named or numbers >= enough or not (words or len(cells) == 1 < width):
            return text, 1 if words or not cells[0] else 0, notes
        text, notes = rest, ("left out: a first line with words",) if numbers and words else notes
    raise InputError(f"{path}: holds words in its first {MOST_HEADINGS} lines, not a table of numbers")


def _delimited(text: bytes) -> tuple[bytes, bytes | None, int]:
    """The text with decimal points; delimiter of its last line, None for spaces, and number of its cells."""
    last = text[text.rstrip(b"\n").rfind(b"\n") + 1 :]
    delimiter = next((sign for sign in (b";", b"\t", b",") if sign in last), None)
    cells = last.split(None, 64)[:64]
    decimal_commas = all(cell.count(b",") < 2 and cell.strip(b",") == cell for cell in cells)
    if delimiter == b"," and len(cells) > 1 and decimal_commas:
        delimiter = None
    width = len(last.rstrip(b"\n").split(delimiter))
    return text if delimiter == b"," else text.replace(b",", b"."), delimiter, width


def _numbers(text: bytes, delimiter: bytes | None, above: int | None = None, **options: Any) -> Array:
    """(rows, cols) numbers, NaN for words.

    Args:
        text: lines of numbers.
        delimiter: None for spaces.
        above: lines of the file above the text, for messages; None: lines of the text are none of the file.
        options: of `numpy.loadtxt`.

    Raises:
        ValueError: a line holds another number of columns, or what is neither a number nor a word.
    """
    options |= {"delimiter": delimiter and delimiter.decode(), "quotechar": '"' if b'"' in text else None}
    # Words take a function for each cell, which is slow.
    for converter in (None, _number):
        file = BytesIO(text)
        # Numpy reads a generator line by line, but a file in blocks, which hides the place of an error.
        lines = (line.decode("latin-1") for line in file)
        try:
            values = np.loadtxt(lines, comments=None, converters=converter, ndmin=2, **options)
            break
        except ValueError as error:
            if converter is not None:
                number = None if above is None else above + text.count(b"\n", 0, file.tell())
                fault = re.sub(r" at row \d+|;.*", "", str(error))
                raise ValueError(fault if number is None else f"line {number}: {fault}") from error
    if not np.isfinite(values).any():
        raise ValueError("no numbers")
    return values


def _number(cell: str) -> float:
    """The number in a cell, NaN for a word. Raises ValueError."""
    word = "#" in cell or not any(map(str.isdigit, cell))
    return np.nan if word else float(cell.replace(",", "."))


def _is_axis(lines: Array, *, whole: bool) -> bool:
    """Whether the first of two lines holds evenly spaced coordinates of heights rather than heights as well.

    Args:
        lines: (2, count) numbers.
        whole: whether coordinates are row numbers.
    """
    if len(lines) < 2 or lines.shape[1] < 3:
        return False
    line, differences = lines[0], lines[0] - lines[1]
    step = (line[-1] - line[0]) / (len(line) - 1)
    deviation = np.abs(line - line[0] - step * np.arange(len(line))).max()
    even = deviation <= min(UNEVEN * np.ptp(line), abs(step)) and (np.diff(line) / step >= 0.0).all()
    own = not np.nanmax(differences) - np.nanmin(differences) < OWN * np.ptp(line)
    return bool(even and own and not (whole and (np.diff(line) != 1.0).any()))
