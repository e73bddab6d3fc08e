"""Reader of GLB, the binary form of glTF 2.0: meshes of triangles in a tree of nodes, in metres, y up."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from relief.common.arrays import Array
from relief.common.errors import InputError
from relief.meshes.parsed import MOST_FACES, Parsed
from relief.meshes.text_formats import check_count

METRE_MM = 1000.0
TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Types of numbers by the codes of glTF."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Row vectors (x, y, z) with y up times this are (x, -z, y), with z up."""
TRIANGLES = 4
"""Mode of a primitive of separate triangles."""
MOST_NODES, DEEPEST = 10_000, 64


def read_glb(content: bytes, path: Path) -> Parsed:
    """Read all meshes of the scene that a GLB shows. Raises InputError."""
    words = np.frombuffer(content[:20], "<u4") if len(content) >= 20 else np.zeros(5, "<u4")
    if content[:4] != b"glTF" or words[1] != 2 or content[16:20] != b"JSON":
        raise InputError(f"{path}: damaged or not a GLB of glTF 2.0")
    end = 20 + int(words[3])
    document = json.loads(content[20:end])
    # The second chunk, past its length and type.
    scene = _Scene(document, content[end + 8 :], path)
    shown = document.get("scenes", [{}])[document.get("scene", 0)].get("nodes", [])
    for node in shown:
        scene.add(node, np.eye(4), 0)
    return scene.joined()


class _Scene:
    """Meshes of a tree of nodes, gathered at their places."""

    def __init__(self, document: dict[str, Any], binary: bytes, path: Path) -> None:
        self._document, self._binary, self._path = document, binary, path
        self._vertices: list[Array] = []
        self._faces: list[Any] = []
        self._uv: list[Any] = []
        self._nodes = self._count = self._points = 0

    def add(self, number: int, above: Array, depth: int) -> None:
        self._nodes += 1
        if depth > DEEPEST or self._nodes > MOST_NODES:
            raise InputError(f"{self._path}: more than {MOST_NODES} nodes, or {DEEPEST} within one another")
        node = self._document["nodes"][number]
        place = above @ _matrix(node)
        if "mesh" in node:
            for primitive in self._document["meshes"][node["mesh"]]["primitives"]:
                self._add_primitive(primitive, place)
        for child in node.get("children", []):
            self.add(child, place, depth + 1)

    def _add_primitive(self, primitive: dict[str, Any], place: Array) -> None:
        if primitive.get("mode", TRIANGLES) != TRIANGLES:
            return
        if "KHR_draco_mesh_compression" in primitive.get("extensions", {}):
            raise InputError(f"{self._path}: is compressed by Draco; save it without compression")
        attributes = primitive["attributes"]
        vertices = self._numbers(attributes["POSITION"], 3).astype(np.float64)
        if "indices" in primitive:
            faces = self._numbers(primitive["indices"], 1).astype(np.int64)
        else:
            faces = np.arange(len(vertices))
        faces = faces.reshape(-1, 3)
        if faces.size and faces.max() >= len(vertices):
            raise InputError(f"{self._path}: faces name vertices that the file does not have")
        uv = self._numbers(attributes["TEXCOORD_0"], 2) if "TEXCOORD_0" in attributes else None
        # glTF counts v from the top of the picture; whole numbers stand for shares, which few programs write.
        if uv is not None and uv.dtype.kind != "f":
            uv = None
        self._uv.append(None if uv is None else uv[faces] * (1.0, -1.0) + (0.0, 1.0))
        if np.linalg.det(place[:3, :3]) < 0.0:
            # A mirror image turns faces inside out.
            faces = faces[:, ::-1]
            self._uv[-1] = None if self._uv[-1] is None else self._uv[-1][:, ::-1]
        self._count += len(faces)
        check_count(self._count, "faces", self._path)
        self._faces.append(faces + self._points)
        self._points += len(vertices)
        self._vertices.append((vertices @ place[:3, :3].T + place[:3, 3]) @ Z_UP)

    def _numbers(self, index: int, width: int) -> Any:
        """Values (count, width) of an accessor, or (count,) of width 1."""
        accessor = self._document["accessors"][index]
        count, kind = int(accessor["count"]), np.dtype(TYPES[accessor["componentType"]])
        check_count(count, "values of an accessor", self._path, 3 * MOST_FACES)
        if WIDTHS.get(accessor["type"]) != width or "sparse" in accessor or "bufferView" not in accessor:
            raise InputError(f"{self._path}: accessor {index}: is sparse, empty or of an unknown type")
        view = self._document["bufferViews"][accessor["bufferView"]]
        start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
        stride = int(view.get("byteStride", kind.itemsize * width))
        needed = start + stride * (count - 1) + kind.itemsize * width
        if min(start, count - 1) < 0 or stride < kind.itemsize * width or needed > len(self._binary):
            raise InputError(f"{self._path}: accessor {index}: reaches beyond the file")
        values = np.ndarray((count, width), kind, self._binary, start, (stride, kind.itemsize))
        return values[:, 0] if width == 1 else values

    def joined(self) -> Parsed:
        """All meshes as one; texture coordinates only if all have them."""
        if not self._faces:
            raise InputError(f"{self._path}: shows no triangles")
        uv = None if any(each is None for each in self._uv) else np.concatenate(self._uv)
        return Parsed(np.concatenate(self._vertices), np.concatenate(self._faces), uv, METRE_MM)


def _matrix(node: dict[str, Any]) -> Array:
    """(4, 4) of a node, for column vectors."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    place = np.eye(4)
    place[:3, :3] = turn * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=np.float64)
    place[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return place
