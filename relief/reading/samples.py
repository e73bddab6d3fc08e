"""Samples: what a file holds, before anyone decides what of it is height."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import AnyArray, Array
from relief.ground.errors import InputError
from relief.ground.formats import Repeats
from relief.ground.lengths import HEADER, shown
from relief.ground.progress import say

MOST_PIXELS = 178_956_970
"""Most pixels of a picture, Pillow's limit for decompression bombs; an A4 page of 1200 dots an inch has
139e6."""
LONGEST_SIDE = 32_768
"""Most pixels along a side."""
SQUARE = 0.01
"""Largest difference of the sides of a pixel, in sides; resolutions in headers are rounded."""
OBLONG = 10.0
"""Largest ratio of the sides of a pixel; a header with a larger one says nothing about the picture."""
NO_DATA = (999.0, 9999.0, 99999.0, 999999.0, 32767.0, 32768.0, 2147483648.0)
"""Magnitudes of numbers that stand for samples without a measurement in elevation models and in tables of
instruments, also without a word about them: see `without_stand_ins`."""
FAR = 10.0
"""Distance of a number that stands for no measurement, and is not a usual one, in the range of the others."""
LARGEST = 1e30
"""Magnitude from which a number stands for no measurement: the limits of types, and 1.7e38 of Surfer."""
TILE = f"{HEADER}repeats"
"""Name in a header of the axes along which a relief repeats."""
TILE_MARKS: Mapping[str, Repeats] = {"xy": True, "x": "x", "y": "y"}
"""Texts of `TILE`. PNG and EXR carry it; nothing in a TIFF or NPY says that it is a tile."""


LAYER = f"{HEADER}layer_um"
"""Name in a header of the layers that a print's heights are of, um."""


Check = Callable[[tuple[int, ...], Path], None]
"""A function that raises InputError for a shape (rows, cols) that must not be read."""


@dataclass(frozen=True, eq=False)
class Samples:
    """What a file holds.

    Attributes:
        path: the file.
        kind: for a person, as in "PNG in colour".
        channels: (rows, cols) by name: "Y", or "R", "G" and "B" where these differ, and "A" if a part is
            transparent. Row 0 is the top. Grey and colours are as stored; numbers are floating-point, NaN
            where nothing was measured.
        bits: bits of a channel as stored; None for numbers with a unit of their own, such as mm.
        white: stored value of white, where black is 0; 1 for numbers.
        count: pictures in the file, of which this is one.
        notes: what was done on reading, for a person.
        lengths: size_mm and relief_mm of a header that Retouch has written; size_mm of a measured surface.
        unit_mm: mm for a number of 1, where the file states its unit.
        repeats: axes along which the header says that the relief repeats.
        instrument: whether an instrument measured the numbers, from a zero of its own.
        printed: whether the header says that the heights are a print's, of whole layers.
    """

    path: Path
    kind: str
    channels: Mapping[str, AnyArray]
    bits: int | None = None
    white: float = 1.0
    count: int = 1
    notes: tuple[str, ...] = ()
    lengths: Mapping[str, float] = field(default_factory=dict)
    unit_mm: float | None = None
    repeats: Repeats = False
    instrument: bool = False
    printed: bool = False

    @property
    def width(self) -> int:
        """Columns."""
        return int(next(iter(self.channels.values())).shape[1])

    @property
    def height(self) -> int:
        """Rows."""
        return len(next(iter(self.channels.values())))

    @property
    def holds_numbers(self) -> bool:
        """Whether the values are numbers rather than grey."""
        return self.bits is None

    @property
    def values(self) -> Array:
        """(rows, cols) of the only channel: grey from 0 to 1, or numbers, NaN where nothing was measured."""
        return self.channels["Y"].astype(np.float64, order="C") / self.white

    @property
    def coloured(self) -> bool:
        """Whether the colours differ."""
        return "Y" not in self.channels


def check_extent(shape: tuple[int, ...], path: Path) -> None:
    """Raise InputError for (rows, cols, ...) of which there are none, or more than are read of any file."""
    rows, cols = shape[:2]
    if min(rows, cols) < 1:
        raise InputError(f"{path}: {cols} x {rows} pixels; there is nothing in it")
    if max(rows, cols) > LONGEST_SIDE or rows * cols > MOST_PIXELS:
        most = f"{LONGEST_SIDE} pixels a side and {MOST_PIXELS / 1e6:.0f} million in all"
        raise InputError(f"{path}: {cols} x {rows} pixels; at most {most} are read")


def check_square(across: float, down: float, path: Path) -> None:
    """Raise InputError if a pixel is not as wide (across) as high (down), both in one unit."""
    if across <= 0.0 or down <= 0.0 or not 1.0 / OBLONG <= across / down <= OBLONG:
        return
    if abs(across / down - 1.0) > SQUARE:
        sides = f"{across / down:.3g} times as wide as high"
        raise InputError(f"{path}: its pixels are {sides}; resample the picture to square pixels first")


def grey_or_colours(*layers: AnyArray) -> dict[str, AnyArray]:
    """Channels by name of grey or three colours, perhaps with alpha; "Y" in place of colours that agree.

    Alpha is left out where nothing is transparent: 1, or the largest whole number of its type.
    """
    alpha = {"A": layers[-1]} if len(layers) in (2, 4) else {}
    first, *others = layers[: len(layers) - len(alpha)]
    if alpha and (layers[-1] == (1.0 if first.dtype.kind == "f" else np.iinfo(first.dtype).max)).all():
        alpha = {}
    if all(np.array_equal(first, other, equal_nan=first.dtype.kind == "f") for other in others):
        return {"Y": first} | alpha
    return {"R": first, "G": others[0], "B": others[1]} | alpha


def without_transparent(channels: dict[str, AnyArray]) -> dict[str, AnyArray]:
    """Channels of numbers, not measured where they are transparent; alpha stays where it is partial."""
    if "A" not in channels:
        return channels
    seen = channels["A"] > 0
    numbers = {name: np.where(seen, one, np.nan) for name, one in channels.items() if name != "A"}
    partial = seen.any() and np.ptp(channels["A"][seen]) > 0
    return numbers | ({"A": channels["A"]} if partial else {})


def measured(
    values: AnyArray, no_data: float | None = None, missing: NDArray[np.bool_] | None = None
) -> AnyArray:
    """Numbers in single or double precision, NaN where nothing was measured.

    Args:
        values: (rows, cols) of any type of real numbers.
        no_data: the number that stands for no measurement, where the file says so.
        missing: (rows, cols) whether the file says so in another way.
    """
    exact = values.dtype in (np.float16, np.float32, np.int8, np.uint8, np.int16, np.uint16)
    with np.errstate(invalid="ignore", over="ignore"):
        numbers = values.astype(np.float32 if exact else np.float64)
        holes = ~(np.abs(numbers) < LARGEST)
        if no_data is not None:
            holes |= numbers == numbers.dtype.type(no_data)
        if missing is not None:
            holes |= missing
    numbers[holes] = np.nan
    return numbers if no_data is not None else without_stand_ins(numbers)


def without_stand_ins(numbers: AnyArray, *, usual: bool = True) -> AnyArray:
    """Set numbers to NaN that stand for no measurement by their distance from the others, and report them.

    Such a number is the lowest or the highest. A usual one, of `NO_DATA`, is farther from the others than
    98 % of these are from one another; an unusual one is `FAR` times as far, and on several samples.

    Args:
        numbers: of any shape, NaN where nothing was measured; they are changed.
        usual: whether usual numbers alone are looked for.
    """
    ends = {float(end.reduce(numbers, axis=None)) for end in (np.fmin, np.fmax)}
    ends = {end for end in ends if not usual or abs(end) in NO_DATA}
    others = numbers[np.isfinite(numbers) & ~np.isin(numbers, list(ends))].astype(float) if ends else numbers
    spread = float(np.ptp(np.percentile(others, (1, 99)))) if ends and others.size else np.inf
    for end in ends:
        found = numbers == end
        count, known = np.count_nonzero(found), abs(end) in NO_DATA
        far = np.abs(others - end).min(initial=np.inf) > spread * (1.0 if known else FAR)
        # Levels of a flat surface may be any number but a negative one with a name.
        if far and (spread > 0.0 or (known and end < 0.0)) and (known or count > 1):
            numbers[found] = np.nan
            say(f"{count} of {numbers.size} numbers are {end:g}, far from the others: not measured")
    return numbers


def repeats_of(header: Mapping[Any, Any], path: Path) -> Repeats:
    """The axes along which a hostile header says that the relief repeats. Raises InputError."""
    if TILE not in header:
        return False
    mark = str(header[TILE])
    if mark not in TILE_MARKS:
        raise InputError(f"{path}: header: repeats: {shown(mark)} is none of {', '.join(TILE_MARKS)}")
    return TILE_MARKS[mark]
