"""Writer of OBJ, a text with an object for each part."""

from collections.abc import Sequence
from typing import BinaryIO

from relief.ground.lengths import shown
from relief.solids.body import Part
from relief.solids.export.written_numbers import nine_digits, rows_as_text

rounded = nine_digits
"""Coordinates as the file holds them."""


def write(parts: Sequence[Part], file: BinaryIO) -> None:
    """Write parts, each an object of its name; a comment states the unit, which the format lacks."""
    first = 1
    file.write(b"# Retouch, millimetres, z up\n")
    for part in parts:
        vertices, faces = part.placed
        # Programs end a name at the first space.
        file.write(f"o {shown(part.name).replace(' ', '_')}\n".encode())
        file.writelines(rows_as_text("v %.9g %.9g %.9g\n", vertices))
        file.writelines(rows_as_text("f %d %d %d\n", faces + first))
        first += len(vertices)
