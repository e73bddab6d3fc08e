"""The content of a file of a mesh before checks, and the limits of readers."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relief.ground.errors import InputError

MOST_FACES = 4_000_000
"""Most faces of a mesh that is read; a plate of 1400 x 1400 samples has as many."""
MOST_VERTICES = 3 * MOST_FACES
"""Most vertices; more cannot all be corners."""
LARGEST_FILE = 1 << 29
"""Most bytes of a file, packed and unpacked; 4 million faces take 200 MB of STL and 300 MB of 3MF."""


@dataclass(frozen=True)
class Piece:
    """A part of a file, or a volume of a 3MF, at one of its places.

    Attributes:
        name: As a slicer or a modelling program shows it.
        first: Number of its first face, when the faces of all pieces are counted.
        path: Places of the item in the build, and of the components in what is above each.
        span: Number of its first triangle in the mesh of its object, and the number after the last.
        placement: (4, 3) of the mesh of its object, for row vectors, in the file's unit.
        cut: Path of what holds the negative volumes that are cut out of the piece; None: there are none.
    """

    name: str
    first: int
    path: tuple[int, ...] = ()
    span: tuple[int, int] = (0, 0)
    placement: Any = None
    cut: tuple[int, ...] | None = None


@dataclass(frozen=True)
class Parsed:
    """Content of a file.

    Attributes:
        vertices: (n, 3) in the file's unit, z up.
        faces: (m, 3) numbers of vertices.
        uv: (m, 3, 2) texture coordinates of corners, or None.
        colours: (m, 3, 3) red, green and blue of corners in sRGB, from 0 to 1, or None.
        unit_mm: mm of the file's unit; None where the format has none.
        warnings: lines about content that was left out.
        pieces: of the file, whose faces are counted one after the other; empty for one without a name.
        origin: (m,) number of the face of the file that each face lies in, -1 for none; None: its own number.
    """

    vertices: Any
    faces: Any
    uv: Any = None
    unit_mm: float | None = None
    warnings: tuple[str, ...] = ()
    colours: Any = None
    pieces: "tuple[Piece, ...]" = ()
    origin: Any = None


def check_count(count: int, what: str, path: Path, most: int = MOST_FACES) -> None:
    """Raise InputError if a file says that it has more of something than is read."""
    if count > most:
        raise InputError(f"{path}: has {count} {what}; at most {most} are read: decimate the mesh")


def check_numbers(numbers: Any, count: int, what: str, path: Path) -> None:
    """Raise InputError if faces name something that the file has too few of."""
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < count:
        raise InputError(f"{path}: faces name {what} that the file does not have")
