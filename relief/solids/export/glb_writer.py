"""Writer of GLB, the binary form of glTF 2.0, for Blender, browsers and game engines."""

import json
from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np

from relief.ground.arrays import AnyArray, Array
from relief.ground.lengths import shown
from relief.ground.srgb import linear_rgb
from relief.solids.body import Part

MM_TO_METRES_Y_UP = 1e-3 * np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Row vectors in mm with z up times this are in metres with y up, as glTF defines."""
FLOAT, INTEGER = 5126, 5125
"""Types of numbers: float32 and uint32."""
VERTICES, INDICES = 34962, 34963
"""Uses of a buffer."""
MATERIAL = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.7}}
"""A matt plastic; without a material glTF means metal, which many viewers show black."""


def rounded(vertices: Array) -> Array:
    """Coordinates (n, 3) as the file holds them: metres in single precision."""
    metres = (vertices @ MM_TO_METRES_Y_UP).astype(np.float32).astype(np.float64)
    return np.asarray(metres @ (1e6 * MM_TO_METRES_Y_UP.T))


def write(parts: Sequence[Part], file: BinaryIO) -> None:
    """Write parts in metres, each a mesh of its name, with colours where it has them."""
    buffer = _Buffer()
    meshes = [{"name": shown(part.name), "primitives": [_primitive(part, buffer)]} for part in parts]
    document = {
        "asset": {"version": "2.0", "generator": "Retouch"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(parts)))}],
        "nodes": [{"name": mesh["name"], "mesh": number} for number, mesh in enumerate(meshes)],
        "meshes": meshes,
        "materials": [MATERIAL],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.length}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    # Chunks are whole words of four bytes; those of the buffer are so by themselves.
    text += b" " * (-len(text) % 4)
    heads = _words(len(text)) + b"JSON" + text + _words(buffer.length) + b"BIN\0"
    file.write(b"glTF" + _words(2, 12 + len(heads) + buffer.length) + heads)
    file.writelines(values.tobytes() for values in buffer.arrays)


class _Buffer:
    """The arrays of numbers of a file, and the tables that describe them: views and accessors of glTF."""

    def __init__(self) -> None:
        self.arrays: list[AnyArray] = []
        self.length = 0
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: AnyArray, use: int, **more: Any) -> int:
        """Append (count, 3) float32 or (count,) uint32; returns the number of the accessor."""
        # Single bytes of colours would have to be padded; four bytes a number keep every array aligned.
        self.views.append(
            {"buffer": 0, "byteOffset": self.length, "byteLength": values.nbytes, "target": use}
        )
        self.arrays.append(values)
        self.length += values.nbytes
        self.accessors.append(
            {
                "bufferView": len(self.views) - 1,
                "componentType": FLOAT if values.ndim == 2 else INTEGER,
                "count": len(values),
                "type": "VEC3" if values.ndim == 2 else "SCALAR",
                **more,
            }
        )
        return len(self.accessors) - 1


def _primitive(part: Part, buffer: _Buffer) -> dict[str, Any]:
    vertices, faces = part.placed
    points = (vertices @ MM_TO_METRES_Y_UP).astype("<f4")
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    attributes = {"POSITION": buffer.add(points, VERTICES, min=low, max=high)}
    if part.colours is not None:
        attributes["COLOR_0"] = buffer.add(linear_rgb(part.colours).astype("<f4"), VERTICES)
    indices = buffer.add(faces.astype("<u4").ravel(), INDICES)
    return {"attributes": attributes, "indices": indices, "material": 0}


def _words(*numbers: int) -> bytes:
    return np.array(numbers, "<u4").tobytes()
