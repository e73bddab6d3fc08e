"""Options of a preparation; this module imports nothing heavy."""

import argparse
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.lengths import RANGES
from relief.ground.limits import LARGEST_SIDE, PATCH_SIDE_MM, SMALLEST_SIDE
from relief.ground.options import Option, whole_number
from relief.plate_options import fill_option, height_scale_option, level_option, size_option

GREYS: Mapping[str, Mapping[str, float]] = {
    "luminance": {"R": 0.2126, "G": 0.7152, "B": 0.0722},
    "mean": {"R": 1 / 3, "G": 1 / 3, "B": 1 / 3},
    "red": {"R": 1.0},
    "green": {"G": 1.0},
    "blue": {"B": 1.0},
    "alpha": {"A": 1.0},
}
"""Weights of the channels of a coloured picture, as stored, by the name of the grey.

Those of luminance are of ITU-R BT.709.
"""
METHODS = ("blend", "cut")
"""Ways to join the borders of a tile; `relief.preparing.tiling` describes them."""
TURNS = (0, 90, 180, 270)
"""Degrees by which a picture may be turned."""
AUTO = "auto"
"""The texture as it is if it repeats, else the way with the smaller seam error."""
MOST_USUAL_SAMPLES = 128
"""Default of the most samples a side: one for each pixel of the pictures of the bundled scenes."""
OUTPUTS = (".png", ".exr")
"""Suffixes of the files that are written."""
Box = tuple[int, int, int, int]
"""Four numbers of a part of a picture, in pixels from its upper left corner."""


def check_output(path: str | os.PathLike[str]) -> Path:
    """Return the path of a height map to write; InputError if its suffix is not one of `OUTPUTS`."""
    path = Path(path)
    if path.suffix.lower() not in OUTPUTS:
        raise InputError(f"{path}: a height map is written as {' or '.join(OUTPUTS)}")
    return path


def read_crop(text: str) -> tuple[int, ...]:
    """Read "X,Y,W,H". Raises argparse.ArgumentTypeError."""
    parts = text.split(",")
    if len(parts) != 4:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not X,Y,W,H, four whole numbers of pixels")
    return tuple(whole_number(0, 10**6)(part.strip()) for part in parts)


@dataclass(frozen=True, kw_only=True)
class LengthOptions:
    """Lengths of the plate."""

    relief_mm: Annotated[
        float | None,
        Option(
            "height of the highest pixel above the lowest, mm; written to OUT",
            "MM",
            RANGES["relief_mm"],
            default="the file's",
            exclusive="scale",
        ),
    ] = None
    height_scale: Annotated[float | None, height_scale_option("the file's unit, else 1")] = None
    units: Annotated[
        str | None,
        Option("unit, in place of --height-scale", choices=tuple(UNITS), default="", exclusive="scale"),
    ] = None
    size_mm: Annotated[
        float | None, size_option("side of the plate", f"the file's, else {PATCH_SIDE_MM:g}")
    ] = None


@dataclass(frozen=True, kw_only=True)
class PartOptions:
    """Which part of the picture is taken, and how finely."""

    GROUP: ClassVar = "what is taken"

    crop: Annotated[
        Box | None,
        Option(
            "the part W pixels wide and H high, X from the left and Y from the top (default: the picture); "
            "if it is not square, the square in its middle",
            "X,Y,W,H",
            read=read_crop,
        ),
    ] = None
    centre: Annotated[
        int | None,
        Option("the square of N pixels a side in the middle", "N", (1, 10**6), default="the largest"),
    ] = None
    rotate: Annotated[
        int, Option("turn the part anticlockwise by 90, 180 or 270 degrees", "DEGREES", choices=TURNS)
    ] = 0
    samples: Annotated[
        int | None,
        Option(
            "samples a side",
            "N",
            (SMALLEST_SIDE, LARGEST_SIDE),
            default=f"one a pixel, at most {MOST_USUAL_SAMPLES}",
        ),
    ] = None
    grey: Annotated[str, Option("what of a coloured picture is height", choices=tuple(GREYS))] = "luminance"


@dataclass(frozen=True, kw_only=True)
class HeightOptions:
    """How the values become heights."""

    GROUP: ClassVar = "how it becomes height"

    level: Annotated[bool, level_option()] = False
    fill: Annotated[bool, fill_option()] = False
    invert: Annotated[bool, Option("dark is high")] = False
    levels: Annotated[
        str | None,
        Option(
            "what becomes lowest and highest: grey from 0 to 255, or percentiles, as in 0.5%%,99.5%%",
            "LOW,HIGH",
            default="the darkest and the brightest pixel that is taken",
        ),
    ] = None
    keep_steps: Annotated[
        bool, Option("keep the steps of 8-bit grey (default: smoothed by up to half a step)")
    ] = False
    tile: Annotated[
        str | None,
        Option(
            "make the height map periodic: blend (for stochastic textures), cut (for structured ones), or "
            "auto, neither of a texture that repeats already, else the one with the smaller seam error "
            "(default with --tile: auto)",
            "METHOD",
            choices=(AUTO, *METHODS),
            default="",
            alone=AUTO,
        ),
    ] = None
    plate_mm: Annotated[
        float | None,
        Option(
            "repeat the tile over a plate of this side; --size-mm is the tile's", "MM", default="one tile"
        ),
    ] = None


@dataclass(frozen=True, kw_only=True)
class PrepareOptions(LengthOptions, PartOptions, HeightOptions):
    """Options of `retouch prepare` and keywords of `retouch.prepare`."""
