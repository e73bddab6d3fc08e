"""What a reader makes of a file of a mesh, before anything is checked."""

from dataclasses import dataclass
from typing import Any

MOST_FACES = 4_000_000
"""Most faces of a mesh that is read; a plate of 1400 x 1400 samples has as many."""
LARGEST_FILE = 1 << 29
"""Most bytes of a file; 4 million faces take 200 MB of STL."""


@dataclass(frozen=True)
class Parsed:
    """Content of a file.

    Attributes:
        vertices: (n, 3) in the file's unit, z up.
        faces: (m, 3) numbers of vertices.
        uv: (m, 3, 2) texture coordinates of corners, or None.
        unit_mm: mm of the file's unit; None where the format has none.
    """

    vertices: Any
    faces: Any
    uv: Any = None
    unit_mm: float | None = None
