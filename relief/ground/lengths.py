"""Lengths that turn a height map into a plate: their ranges, and their place in a file's header."""

import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypedDict

from relief.ground import limits
from relief.ground.errors import InputError, naming
from relief.ground.formats import UNITS

LONGEST_SHOWN = 160
"""Most characters that a message repeats of a file or of another package's error."""
RANGES = {
    "size_mm": (limits.SMALLEST_PLATE_MM, limits.LARGEST_PLATE_MM),
    "relief_mm": (limits.SMALLEST_RELIEF_MM, limits.LARGEST_RELIEF_MM),
    "height_scale": (1.0 / limits.LARGEST_HEIGHT_SCALE, limits.LARGEST_HEIGHT_SCALE),
}
"""Least and greatest value, both allowed, of each number that turns a height map into a plate."""


class Lengths(TypedDict, total=False):
    """The numbers of `RANGES` as arguments, None if unknown, and the corrections of what was measured; see
    `relief.heightmap.load_height_map`."""

    size_mm: float | None
    relief_mm: float | None
    height_scale: float | None
    level: bool
    fill: bool


HEADER = "retouch."
"""Begin of the names in a file's header, followed by ``size_mm`` or ``relief_mm``."""


def in_range(key: str, number: object) -> float:
    """Return a number that may come from anywhere, as a float.

    Args:
        key: Name of the number, a key of `RANGES`.
        number: A number, or its text.

    Raises:
        InputError: It is no number or out of range; the message starts with ``key``.
    """
    lowest, highest = RANGES[key]
    try:
        value = float(number)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not lowest <= value <= highest:
        raise InputError(f"{key}: {shown(number)} is not a number from {lowest:g} to {highest:g}")
    return value


def within(key: str, number: float | None) -> float | None:
    """`in_range` of a number that may be unknown, which None stands for."""
    return None if number is None else in_range(key, number)


def scale_of(units: str | None, height_scale: float | None) -> float | None:
    """mm for a height of 1, None if neither the unit nor the number states them. Raises InputError."""
    if units is None:
        return height_scale
    if height_scale is not None:
        raise InputError("units: is another scale than height_scale")
    if units not in UNITS:
        raise InputError(f"units: {shown(units)} is not one of {', '.join(UNITS)}")
    return UNITS[units]


def header_of(path: str | os.PathLike[str], **lengths: float | None) -> dict[str, float]:
    """The lengths that are not None, checked, by their names in a header."""
    with naming(path):
        return {HEADER + key: in_range(key, length) for key, length in lengths.items() if length is not None}


def lengths_of(header: Mapping[Any, Any], path: Path) -> dict[str, float]:
    """Lengths of a hostile header, by the names of `relief.reading.samples.Samples`."""
    with naming(f"{path}: header"):
        keys = [key for key in ("size_mm", "relief_mm") if HEADER + key in header]
        return {key: in_range(key, header[HEADER + key]) for key in keys}


def shown(value: object) -> str:
    """Text of a value that may be hostile: one short line of printable characters."""
    text = " ".join(str(value).split())[:LONGEST_SHOWN]
    return "".join(character if character.isprintable() else "?" for character in text)
