"""What was found of pictures, reliefs and runs."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from relief.ground.arrays import FloatArray

Lines = tuple[tuple[str, str], ...]
"""What was done or measured: a word and a sentence each."""


@dataclass(frozen=True)
class Source:
    """A picture as it was found.

    Attributes:
        width, height: pixels.
        relief_mm, size_mm: of its header; the usual ones where there is none.
        tile: whether the header says that the picture repeats.
        notes: what the picture is, in words.
        thumbnail: PNG.
    """

    width: int
    height: int
    relief_mm: float
    size_mm: float
    tile: bool
    notes: str
    thumbnail: bytes


@dataclass(frozen=True, eq=False)
class Shape:
    """Heights and what was done to get them.

    Attributes:
        heights: (rows, cols) mm, float32.
        size_mm: width.
        repeats: along y and x.
        lines: what was done.
        square: x, y and side of the part of the picture that was taken, pixels.
    """

    heights: FloatArray
    size_mm: float
    repeats: tuple[bool, bool]
    lines: Lines = ()
    square: tuple[int, int, int] = (0, 0, 0)

    @property
    def relief_mm(self) -> float:
        """Highest above lowest point, mm."""
        return float(np.ptp(self.heights))


@dataclass(frozen=True)
class FeltPlaces:
    """How a relief feels at some places of the finger.

    Attributes:
        roughness: V of each, no unit.
        contact_area_mm2: of each.
        contact_fraction: share of the patch in contact at each, the mean of those that were pressed together.
    """

    roughness: tuple[float, ...] = ()
    contact_area_mm2: tuple[float, ...] = ()
    contact_fraction: tuple[float, ...] = ()

    def __add__(self, other: Self) -> Self:
        """Both together."""
        return type(self)(
            self.roughness + other.roughness,
            self.contact_area_mm2 + other.contact_area_mm2,
            self.contact_fraction + other.contact_fraction,
        )


@dataclass(frozen=True)
class Reachable:
    """How far the feel can change, and what it costs the look.

    Attributes:
        smoother, rougher: JND at which the pictures visibly change, both positive.
        limit_percent: change of the pictures from which it is visible, % of the mean picture.
        costs: JND and change of the pictures, % of the mean picture.
    """

    smoother: float
    rougher: float
    limit_percent: float
    costs: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Map:
    """A map in colours.

    Attributes:
        picture: data URI of a PNG.
        bar: the same of the colours from low to high.
        low, high: in `unit`.
    """

    picture: str
    bar: str
    low: float
    high: float
    unit: str


@dataclass(frozen=True, eq=False)
class Sides:
    """Original and result of a run.

    Attributes:
        change: heights of the result less those of the original, each about its mean; None for two grids.
        strain: under a finger in the middle, of both.
        places: HTML of the maps of the feel wherever a finger was pressed; empty where that is one place.
    """

    before: Shape
    after: Shape
    change: Map | None
    strain: tuple[Map, Map]
    places: str = ""


@dataclass(frozen=True)
class Written:
    """A file for a printer.

    Attributes:
        lines: what it holds.
    """

    file: str
    lines: Lines
