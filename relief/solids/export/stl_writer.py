"""Writer of binary STL, which holds one body without a name."""

from collections.abc import Sequence
from typing import BinaryIO

import numpy as np

from relief.ground.arrays import in_blocks, units
from relief.solids.body import TRIANGLE, Body, Part, joined
from relief.solids.export.written_numbers import single_precision

rounded = single_precision
"""Coordinates as the file holds them."""


def write(parts: Sequence[Part], file: BinaryIO) -> None:
    """Write all triangles of some parts, block by block."""
    body = joined(parts)
    file.write(b"Retouch".ljust(80) + np.uint32(len(body.faces)).tobytes())
    for faces in in_blocks(body.faces):
        triangles = np.zeros(len(faces), TRIANGLE)
        triangles["normal"] = units(Body(body.vertices, faces).normals)
        triangles["corners"] = body.vertices[faces]
        file.write(triangles.tobytes())
