"""Grids as text: ESRI's .asc, and tables of heights with a row in each line."""

import re
from io import BytesIO
from pathlib import Path

import numpy as np

from relief.ground.errors import InputError
from relief.ground.files import damage_named, read_limited
from relief.reading.samples import Check, Samples, check_square, measured

LARGEST_TEXT = 1 << 28
"""Most bytes of a text: 4096 x 4096 numbers of 16 characters, or 8 million points of three numbers."""
_HEADING = re.compile(rb"^\s*(ncols|nrows|xll\w+|yll\w+|cellsize|dx|dy|nodata_value)\s+(\S+)\s*$", re.I)
"""Line of the heading of an ESRI grid."""
_WORD = re.compile(rb"(?<![\w.+-])(?:[A-Za-z*?_]+|-{2,})(?![\w.])")
"""A word that stands for a number that was not measured, such as NaN, BAD or ---."""


def read_grid(path: Path, check: Check) -> Samples:
    """Read a grid of numbers. Raises InputError, also for points x, y, z."""
    lines = read_limited(path, LARGEST_TEXT).replace(b"\r\n", b"\n").replace(b"\r", b"\n").split(b"\n")
    heading: dict[str, float] = {}
    with damage_named(path, "a table of numbers"):
        while lines and (found := _HEADING.match(lines[0])):
            heading[found[1].decode().lower()] = float(found[2].replace(b",", b"."))
            del lines[0]
        values = _numbers(lines, path)
    if not np.isfinite(values).any():
        raise InputError(f"{path}: holds no numbers")
    if values.shape[1] == 3:
        raise InputError(f"{path}: holds points x, y, z, not a grid; `retouch scan` reads points")
    if heading and values.shape != (heading.get("nrows"), heading.get("ncols")):
        size = f"{heading.get('ncols', 0):g} x {heading.get('nrows', 0):g}"
        raise InputError(f"{path}: {values.shape[1]} x {values.shape[0]} numbers; its heading says {size}")
    check(values.shape, path)
    check_square(heading.get("dx", 1.0), heading.get("dy", 1.0), path)
    kind = "ESRI grid" if heading else "table"
    return Samples(path, f"{kind} of numbers", {"Y": measured(values, heading.get("nodata_value"))})


def _numbers(lines: list[bytes], path: Path) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """(rows, cols) numbers of lines; words that are no numbers are NaN, but for a first line of headings."""
    content = [content for line in lines if (content := line.split(b"#")[0].strip())]
    if not content:
        raise InputError(f"{path}: holds no numbers")
    text = b"\n".join(content)
    delimiter = next((sign for sign in (b";", b"\t", b",") if sign in content[-1]), None)
    if delimiter in (b";", b"\t") and b"." not in text:
        text = text.replace(b",", b".")  # Commas are decimal points.
    if delimiter is not None:
        text = re.sub(rb"(?m)(^|%b) *(?=%b|$)" % (delimiter, delimiter), rb"\1nan", text)
        # A delimiter at the end of each line separates nothing.
        if all(line.endswith(delimiter) for line in content[1:]):
            text = re.sub(rb"(?m)%bnan$" % delimiter, b"", text)
    first, _, rest = text.partition(b"\n")
    if re.search(rb"[A-DF-Za-df-z]", first) and not re.search(rb"(?i)nan", first):
        text = rest
    separator = None if delimiter in (None, b"\t") else delimiter.decode()
    return np.loadtxt(BytesIO(_WORD.sub(b"nan", text)), delimiter=separator, ndmin=2, encoding="latin-1")
