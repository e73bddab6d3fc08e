"""Grids as text: ESRI's .asc, and tables of heights with a row in each line."""

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
MINUS = "\N{MINUS SIGN}".encode()
"""Minus sign that programs for people write."""
WORDS_BYTES = 1 << 20
"""Bytes below a line in which its words may be again: holes."""
MOST_HEADINGS = 9
"""Most lines among which the first row must be: a title, names and units may be above."""
UNEVEN = 0.05
"""Largest deviation of evenly spaced coordinates, in their range, if this is less than a step: 0.0125, 0.025
and 0.0375 may be rounded to 0.01, 0.03 and 0.04."""
OWN = 0.5
"""Least range of the differences of coordinates from the heights beside them, in ranges of the coordinates:
the rows of a tilted plane are even as well, but differ from each other by a constant."""
_HEADING = re.compile(rb"[ \t]*(ncols|nrows|xll\w+|yll\w+|cellsize|dx|dy|nodata\w*)[ \t]+(\S+)[ \t]*\n", re.I)
"""Line of the heading of an ESRI grid."""
_COMMENT = re.compile(rb"(?m)^ *(?:#(?!N/[AD]|NV\b|[A-Z]+(?:/0)?[!?])[^\n]*)?\n+")
"""Empty line or comment; #N/A and the like are holes in tables of spreadsheets."""
_HOLE = re.compile(
    rb"[^\w.]*|n/?[ad]|n\.a\.|[-+]?(nan|inf|infinity)|bad|none|null|no ?data|masked|missing|.*#.*", re.I
)
"""Word on a first line that stands for a number that was not measured; other words are a heading."""


def read_grid(path: Path, check: Check) -> Samples:
    """Read a grid of heights; a row and a column of coordinates are left out, with a note.

    Raises InputError, also for points x, y, z and for profiles.
    """
    content = read_limited(path, LARGEST_TEXT)
    with damage_named(path, "a table of numbers"):
        text = _COMMENT.sub(b"", _lines(content))
        heading: dict[str, float] = {}
        start = 0
        while found := _HEADING.match(text, start):
            heading[found[1].decode().lower().split("_")[0]] = float(found[2].replace(b",", b"."))
            start = found.end()
        values, notes = _esri(text[start:], heading, path, check) if heading else _table(text, path)
    if not np.isfinite(values).any():
        raise InputError(f"{path}: holds no numbers")
    check(values.shape, path)
    check_square(heading.get("dx", 1.0), heading.get("dy", 1.0), path)
    no_data = heading.get("nodata", -9999.0) if heading else None
    kind = "ESRI grid" if heading else "table"
    return Samples(path, f"{kind} of numbers", {"Y": measured(values, no_data)}, notes=notes)


def _lines(content: bytes) -> bytes:
    """A text in a superset of ASCII, with a line feed at the end of each line."""
    if content.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        content = content.decode("utf-16").encode()
    return (
        content.removeprefix(BOM_UTF8).replace(b"\r\n", b"\n").replace(b"\r", b"\n").replace(MINUS, b"-")
        + b"\n"
    )


def _esri(text: bytes, heading: dict[str, float], path: Path, check: Check) -> tuple[Array, tuple[str, ...]]:
    """(nrows, ncols) numbers of a grid whose lines may end anywhere, and no notes."""
    rows, cols = int(heading.get("nrows", 0)), int(heading.get("ncols", 0))
    check((rows, cols), path)
    text, delimiter = _delimited(text)
    one_a_line = text.translate(bytes.maketrans(b" \t" + (delimiter or b" "), b"\n\n\n"))
    values = _numbers(one_a_line, None, rows * cols + 1)
    if values.size != rows * cols:
        held = "more" if values.size > rows * cols else values.size
        raise InputError(f"{path}: its heading says {cols} x {rows} numbers; the file holds {held}")
    return values.reshape(rows, cols), ()


def _table(text: bytes, path: Path) -> tuple[Array, tuple[str, ...]]:
    """(rows, cols) heights with a row in each line, and notes."""
    text, delimiter = _delimited(text)
    heights, without_number, numbers_lost = _below_headings(text, delimiter, path)
    values = _numbers(heights, delimiter, LONGEST_SIDE + 1)
    # A delimiter at the end of each line separates nothing.
    if delimiter and np.isnan(values[:, -1]).all() and heights.count(delimiter + b"\n") >= len(values):
        values = values[:, :-1]
    if values.shape[1] == 3:
        raise InputError(f"{path}: holds points x, y, z, not a grid; `retouch scan` reads points")
    if values.shape[1] < 3:
        raise InputError(
            f"{path}: holds a profile or points ({values.shape[1]} columns), not a grid of heights"
        )
    values, notes = _without_coordinates(values, without_number, len(heights) < len(text))
    return values, ("left out: a first line with words",) * numbers_lost + notes


def _below_headings(text: bytes, delimiter: bytes | None, path: Path) -> tuple[bytes, bool, bool]:
    """The rows of a table, whether their corner is empty or a word, and whether headings held numbers."""
    numbers_lost = False
    for _line in range(MOST_HEADINGS):
        first, _, rest = text.partition(b"\n")
        if not first:
            raise InputError(f"{path}: holds no numbers")
        cells = [cell.strip(b' "') for cell in first.split(delimiter, LONGEST_SIDE + 1)]
        check_extent((1, len(cells)), path)
        words = {cell for cell in cells if not _is_number(cell) and not _HOLE.fullmatch(cell)}
        if words:  # Words that are in rows below as well stand for holes.
            below = rest[:WORDS_BYTES].replace(b"\n", delimiter or b"\n").split(delimiter)
            words.difference_update(cell.strip(b' "') for cell in below)
        numbers = sum(map(_is_number, cells))
        if not words or (words == {cells[0]} and 2 * numbers >= len(cells)):
            if delimiter is None and len(rest.partition(b"\n")[0].split()) == len(cells) + 1:
                return b"nan " + text, True, numbers_lost  # Spaces show no empty corner.
            return text, bool(words) or not cells[0], numbers_lost
        text, numbers_lost = rest, numbers_lost or numbers > 0
    raise InputError(f"{path}: holds words in its first {MOST_HEADINGS} lines, not a table of numbers")


def _delimited(text: bytes) -> tuple[bytes, bytes | None]:
    """The text with decimal points, and the delimiter of its last line; None for spaces."""
    last = text[text.rstrip(b"\n").rfind(b"\n") + 1 :]
    delimiter = next((sign for sign in (b";", b"\t", b",") if sign in last), None)
    cells = last.split(None, 64)[:64]
    decimal_commas = all(cell.count(b",") < 2 and cell.strip(b",") == cell for cell in cells)
    if (delimiter == b"," and len(cells) > 1 and decimal_commas) or (
        delimiter == b"\t" and re.search(rb"\d +[\d+-]", last)
    ):
        delimiter = None
    return text if delimiter == b"," else text.replace(b",", b"."), delimiter


def _numbers(text: bytes, delimiter: bytes | None, most_rows: int) -> Array:
    """(rows, cols) numbers, NaN for words; at most so many rows. Raises ValueError."""
    options: dict[str, Any] = {
        "delimiter": delimiter and delimiter.decode(),
        "comments": None,
        "quotechar": '"' if b'"' in text else None,
        "encoding": "latin-1",
        "ndmin": 2,
        "max_rows": most_rows,
    }
    try:
        return np.loadtxt(BytesIO(text), **options)
    except ValueError:  # There are words, which take ten times as long.
        return np.loadtxt(BytesIO(text), converters=_number, **options)


def _number(cell: str) -> float:
    """The number in a cell, NaN for a word. Raises ValueError."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        if "#" in cell or not any(map(str.isdigit, cell)):
            return np.nan
        raise


def _is_number(cell: bytes) -> bool:
    try:
        return bool(np.isfinite(_number(cell.decode("latin-1"))))
    except ValueError:
        return False


def _without_coordinates(values: Array, empty: bool, headed: bool) -> tuple[Array, tuple[str, ...]]:
    """The heights, and a note on what was left out.

    Args:
        values: (rows, cols) heights, perhaps with coordinates as row and column 0.
        empty: whether the corner holds no number.
        headed: whether a heading was above.
    """
    row, column = _is_axis(values[0, 1:], values[1, 1:]), _is_axis(values[1:, 0], values[1:, 1])
    if not empty and not (row and column):
        # A number at the corner belongs to the one that is left out.
        first, second = values[:2], values[:, :2].T
        row = _is_axis(*first) and bool((np.diff(first[0]) == 1.0).all())
        column = _is_axis(*second) and (headed or bool((np.diff(second[0]) == 1.0).all()))
    left_out = " and ".join(["a row"] * row + ["a column"] * column)
    notes = (f"left out: {left_out} of coordinates",) if left_out else ()
    return values[int(row) :, int(column) :], notes


def _is_axis(line: Array, beside: Array) -> bool:
    """Whether numbers are evenly spaced coordinates of heights beside them, rather than heights as well."""
    if len(line) < 3 or not np.isfinite(line).all() or line[0] == line[-1]:
        return False
    step = (line[-1] - line[0]) / (len(line) - 1)
    deviation = np.abs(line - line[0] - step * np.arange(len(line))).max()
    even = deviation <= min(UNEVEN * np.ptp(line), abs(step)) and (np.diff(line) / step >= 0.0).all()
    return bool(even and not np.nanmax(line - beside) - np.nanmin(line - beside) < OWN * np.ptp(line))
