"""Arrays of whole numbers as text of a page: differences along the rows, sorted by bytes, by zlib."""

import base64
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.solids.body import Body

STEPS = 65535
"""Steps of a coordinate over the longest side of a body: of 100 mm, one is 1.5 µm."""


def packed(values: NDArray[np.unsignedinteger[Any]]) -> dict[str, Any]:
    """An array (n, columns) of unsigned integers as `source/meshes.js` reads it.

    Neighbours in a mesh are alike. So the differences from row to row are kept, the high bytes of all of them
    together, which zlib shrinks to little.
    """
    differences = np.diff(values, axis=0, prepend=np.zeros_like(values[:1]))
    planes = differences.astype(differences.dtype.newbyteorder("<")).reshape(-1, 1).view(np.uint8).T
    text = base64.b64encode(zlib.compress(planes.tobytes(), 6)).decode("ascii")
    return {"data": text, "kind": str(values.dtype), "columns": values.shape[1]}


def packed_places(vertices: Array) -> dict[str, Any]:
    """Places (n, 3), mm, as steps of a coordinate from the lowest corner of their box."""
    low = vertices.min(axis=0)
    step = max(float(np.ptp(vertices, axis=0).max()), 1e-9) / STEPS
    steps = np.rint((vertices - low) / step).astype(np.uint16)
    return {"low": low.tolist(), "step": step, "positions": packed(steps)}


def packed_faces(body: Body) -> dict[str, Any]:
    """Faces (m, 3) of a body, with the smallest integers that count its vertices."""
    return packed(body.faces.astype(np.uint16 if len(body.vertices) <= STEPS else np.uint32))


def packed_colours(colours: Array) -> dict[str, Any]:
    """Colours (n, 3) in sRGB from 0 to 1, as bytes."""
    return packed(np.rint(255.0 * np.clip(colours, 0.0, 1.0)).astype(np.uint8))
