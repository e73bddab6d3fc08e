"""Options of the verbs that take a height map: its lengths, whether it repeats, and the printer."""

import argparse
from dataclasses import dataclass
from typing import Annotated

from relief.ground.formats import UNITS
from relief.ground.lengths import RANGES
from relief.ground.options import Option
from relief.printers import PRINTERS, is_printer_file

LONGEST_NAME = 40
"""Most characters that a message repeats of a name."""


def size_option(what: str, default: str, key: str = "") -> Option:
    """The option of a width; `what` is as wide, and `default` where nothing is given."""
    return Option(f"{what}, mm", "MM", RANGES["size_mm"], default=default, key=key)


def relief_option(default: str, key: str = "") -> Option:
    """The option of the height of a picture's white."""
    text = "height of white above black in a picture, mm"
    return Option(text, "MM", RANGES["relief_mm"], default=default, key=key)


def height_scale_option(default: str, key: str = "") -> Option:
    """The option of the unit of a file of heights."""
    text = "mm for a height of 1 in EXR, NPY and float TIFF"
    return Option(text, "FACTOR", RANGES["height_scale"], default=default, exclusive="scale", key=key)


def units_option(key: str = "") -> Option:
    """The option of the unit of a file of heights, in place of the number."""
    text = f"unit of the heights in EXR, NPY, float TIFF and texts, as --height-scale: {', '.join(UNITS)}"
    return Option(text, "UNIT", default="", read=millimetres, exclusive="scale", key=key)


def millimetres(unit: str) -> float:
    """The millimetres in a unit of length. Raises argparse.ArgumentTypeError."""
    if unit not in UNITS:
        raise argparse.ArgumentTypeError(f"{unit[:LONGEST_NAME]!r} is none of {', '.join(UNITS)}")
    return UNITS[unit]


def level_option(key: str = "") -> Option:
    """The option that takes out a tilt."""
    text = "take out the tilt of what was measured, the plane by least squares, and lift the lowest to 0"
    return Option(text, key=key)


def fill_option(key: str = "") -> Option:
    """The option that fills holes."""
    return Option("fill samples that were not measured smoothly from around", key=key)


def printer_option(what: str, default: str = "none", key: str = "", python: str = "") -> Option:
    """The option of a printer, with which `what` is done."""
    return Option(
        f"{what}: {', '.join(PRINTERS)}, or a printer file (.toml)",
        "PRINTER",
        default=default,
        python=python,
        read=printer,
        key=key,
        label="Printer",
        offered=tuple(PRINTERS),
    )


def printer(text: str) -> str:
    """Read the name of a printer, or of a printer file. Raises argparse.ArgumentTypeError."""
    if text not in PRINTERS and not is_printer_file(text):
        raise argparse.ArgumentTypeError(
            f"{text[:LONGEST_NAME]!r} is none of {', '.join(PRINTERS)}, nor a printer file (.toml)"
        )
    return text


@dataclass(frozen=True, kw_only=True)
class TileOptions:
    """Lengths of a tile, None where its file says them."""

    size_mm: Annotated[float | None, size_option("width of one tile", "the texture's header, or 10")] = None
    relief_mm: Annotated[float | None, relief_option("the texture's header")] = None
    height_scale: Annotated[float | None, height_scale_option("1")] = None
