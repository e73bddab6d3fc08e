"""Writer of binary PLY, which holds one body without a name."""

from collections.abc import Sequence
from typing import BinaryIO

import numpy as np

from relief.ground.arrays import in_blocks
from relief.solids.body import Part, joined
from relief.solids.export.written_numbers import single_precision

rounded = single_precision
"""Coordinates as the file holds them."""
FACE = np.dtype([("count", "u1"), ("vertices", "<i4", 3)])
"""A face of the file."""


def write(parts: Sequence[Part], file: BinaryIO) -> None:
    """Write all triangles of some parts, block by block."""
    body = joined(parts)
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(body.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(body.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    file.write(header.encode())
    for vertices in in_blocks(body.vertices):
        file.write(vertices.astype("<f4").tobytes())
    for corners in in_blocks(body.faces):
        faces = np.zeros(len(corners), FACE)
        faces["count"], faces["vertices"] = 3, corners
        file.write(faces.tobytes())
