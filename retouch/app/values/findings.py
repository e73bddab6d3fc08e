"""What was found of pictures, reliefs and runs."""

from collections.abc import Mapping
from dataclasses import dataclass

from relief.ground.arrays import Array
from relief.relief import Relief
from retouch.app.values.document import PictureChoice

CONTACT = "contact_fraction"
"""Name of the share of the patch under pressure, among the values of the quantities that are felt."""
Lines = tuple[tuple[str, str], ...]
"""What was done or measured: a word and a sentence each."""


@dataclass(frozen=True)
class Source:
    """A picture as it was found.

    Attributes:
        picture: the whole of it, with the lengths of its header, or the usual ones where there is none.
        width, height: pixels.
        notes: what the picture is, in words.
        thumbnail: PNG.
    """

    picture: PictureChoice
    width: int
    height: int
    notes: str
    thumbnail: bytes


@dataclass(frozen=True, eq=False)
class PreparedPicture:
    """The relief that was made of a picture.

    Attributes:
        lines: what was done.
        square: x, y and side of the part of the picture that was taken, pixels.
        tile: of the part of it that a tile repeats; None: the whole.
    """

    relief: Relief
    lines: Lines
    square: tuple[int, int, int]
    tile: tuple[int, int, int] | None


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
class Draft:
    """What a run may make of a relief; it is shown and nothing more.

    Attributes:
        relief: the result of a few steps.
        ratios: means of the quantities of touch over the original's, by name, as far as they are known.
        change_percent_of_white, change_percent: mean change of the pictures, in % of white and of their mean.
        relative_error: distance from the goal.
        met: whether that counts as reached.
        change: heights less those of the original.
        memory: of the descent, to go on from here.
    """

    relief: Relief
    ratios: Mapping[str, float]
    change_percent_of_white: float
    change_percent: float
    relative_error: float
    met: bool
    change: Map
    memory: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Sides:
    """Original and result of a run.

    Attributes:
        change: heights of the result less those of the original, each about its mean; None for two grids.
        strain: under a finger in the middle, of both.
        places: HTML of the maps of the feel wherever a finger was pressed; empty where that is one place.
    """

    before: Relief
    after: Relief
    change: Map | None
    strain: tuple[Map, Map]
    places: str = ""


@dataclass(frozen=True)
class Written:
    """A file that a worker has written: a plate for a printer, an object, or a page about one.

    The results of the verbs stay in the worker: that of `retouch.wrap` holds the whole mesh, tens of MB, and
    none of them has the warnings of the models.

    Attributes:
        lines: what the file holds, and warnings.
    """

    file: str
    lines: Lines
