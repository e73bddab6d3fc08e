"""Reader of GLB, the binary form of glTF 2.0: meshes of triangles in a tree of nodes, in metres, y up."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array, Index, renumbered, units
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.srgb import srgb
from relief.solids.files.parsed_mesh import MOST_VERTICES, Parsed, Piece, check_count, check_numbers

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""Types of numbers by the codes of glTF."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
Z_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Row vectors (x, y, z) with y up times this are (x, -z, y), with z up."""
TRIANGLES, STRIP, FAN = 4, 5, 6
"""Modes of a primitive of triangles: separate ones, a strip, a fan."""
MOST_NODES, DEEPEST = 10_000, 64
"""Most nodes that are shown, and most within one another."""
MOST_PRIMITIVES = 10 * MOST_NODES
"""Most primitives of the nodes that are shown."""
LARGEST_DOCUMENT = 1 << 24
"""Most bytes of the JSON of a GLB; ten thousand nodes take ten megabytes."""
UNREAD = ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "EXT_mesh_gpu_instancing")
"""Extensions without which the triangles would be others."""


def read_glb(content: bytes, path: Path, cad: bool = False) -> Parsed:
    """Read all meshes of the scene that a GLB shows. Raises InputError.

    Args:
        content: Of the file.
        path: Of the file, for messages.
        cad: Whether a CAD kernel made the GLB: z is up, and normals, names and colours of parts are read.
    """
    words = np.frombuffer(content[:20], "<u4") if len(content) >= 20 else np.zeros(5, "<u4")
    if content[:4] != b"glTF" or words[1] != 2 or content[16:20] != b"JSON":
        raise InputError(f"{path}: damaged or not a GLB of glTF 2.0")
    end = 20 + int(words[3])
    if words[3] > LARGEST_DOCUMENT:
        raise InputError(f"{path}: has a description of more than {LARGEST_DOCUMENT} bytes; join its parts")
    document = json.loads(content[20:end])
    for extension in UNREAD:
        if extension in document.get("extensionsUsed", []):
            raise InputError(f"{path}: uses {extension}; save it without compression and instances")
    # The second chunk, past its length and type.
    scene = _Scene(document, memoryview(content)[end + 8 :], path, cad)
    shown = document.get("scenes", [{}])[document.get("scene", 0)].get("nodes", [])
    for node in shown:
        scene.add(node, np.eye(4), 0)
    return scene.joined()


class _Scene:
    """Meshes of a tree of nodes, gathered at their places."""

    def __init__(self, document: dict[str, Any], binary: memoryview, path: Path, cad: bool) -> None:
        self._document, self._binary, self._path, self._cad = document, binary, path, cad
        self._up = np.eye(3) if cad else Z_UP
        # Vertices, faces, and at their corners texture coordinates, colours and normals, or None.
        self._shown: list[tuple[Any, ...]] = []
        self._pieces: list[Piece] = []
        self._nodes = self._primitives = self._count = self._points = 0

    def add(self, number: int, above: Array, depth: int) -> None:
        """Add a node of the document and those within it, which lie at `above`. Raises InputError."""
        self._nodes += 1
        if depth > DEEPEST or self._nodes > MOST_NODES:
            raise InputError(f"{self._path}: more than {MOST_NODES} nodes, or {DEEPEST} within one another")
        node = self._item("nodes", number)
        place = above @ _matrix(node)
        if "mesh" in node:
            mesh = self._item("meshes", node["mesh"])
            if self._cad:
                self._pieces.append(Piece(str(mesh.get("name", "")), self._count))
            for primitive in mesh["primitives"]:
                self._add_primitive(primitive, place)
        for child in node.get("children", []):
            self.add(child, place, depth + 1)

    def _item(self, kind: str, number: int) -> dict[str, Any]:
        """An item of a list of the document; a negative number names none. Raises InputError."""
        items: list[dict[str, Any]] = self._document.get(kind, [])
        if not 0 <= number < len(items):
            raise InputError(f"{self._path}: {kind}: has no item {number}")
        return items[number]

    def _add_primitive(self, primitive: dict[str, Any], place: Array) -> None:
        self._primitives += 1
        check_count(self._primitives, "primitives", self._path, MOST_PRIMITIVES)
        mode = primitive.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN):
            return
        attributes = primitive["attributes"]
        vertices = self._numbers(attributes["POSITION"], 3)
        if vertices.dtype.kind != "f" and self._item("accessors", attributes["POSITION"]).get("normalized"):
            raise InputError(f"{self._path}: positions are normalized; save them as floats")
        corners = self._numbers(primitive["indices"], 1) if "indices" in primitive else None
        # Counted before anything is as long as that: files may show the same numbers ten thousand times.
        count = len(vertices if corners is None else corners)
        self._count += count // 3 if mode == TRIANGLES else max(count - 2, 0)
        check_count(self._count, "faces", self._path)
        faces = _triangles(np.arange(count) if corners is None else corners.astype(np.int64), mode)
        check_numbers(faces, len(vertices), "vertices", self._path)
        uv: Any = None
        normals: Any = None
        at = self._numbers(attributes["TEXCOORD_0"], 2) if "TEXCOORD_0" in attributes else None
        # Whole numbers stand for shares, which few programs write.
        if at is not None and at.dtype.kind == "f":
            check_numbers(faces, len(at), "texture coordinates", self._path)
            # glTF counts v from the top of the picture.
            uv = at[faces] * (1.0, -1.0) + (0.0, 1.0)
        colours = self._painted(primitive, faces) if self._cad else self._coloured(attributes, faces)
        if self._cad:
            normals = units(self._numbers(attributes["NORMAL"], 3)[faces] @ place[:3, :3].T @ self._up)
        if np.linalg.det(place[:3, :3]) < 0.0:
            # A mirror image turns faces inside out.
            faces = faces[:, ::-1]
            at_corners = uv, colours, normals
            uv, colours, normals = (None if each is None else each[:, ::-1] for each in at_corners)
        if len(vertices) > 3 * len(faces):
            # Primitives may share vertices of which each needs a few.
            used, faces = renumbered(faces, len(vertices))
            vertices = vertices[used]
        placed = (vertices.astype(np.float64) @ place[:3, :3].T + place[:3, 3]) @ self._up
        self._shown.append((placed, faces + self._points, uv, colours, normals))
        self._points += len(vertices)

    def _painted(self, primitive: dict[str, Any], faces: Index) -> Any:
        """Colour (m, 3, 3) of a primitive's material, as `_coloured`; white without one; None if none has."""
        if not self._document.get("materials"):
            return None
        material = self._item("materials", primitive["material"]) if "material" in primitive else {}
        colour = material.get("pbrMetallicRoughness", {}).get("baseColorFactor", (1.0, 1.0, 1.0))
        return np.broadcast_to(srgb(np.array(colour[:3], np.float32), 1.0), (len(faces), 3, 3))

    def _coloured(self, attributes: dict[str, Any], faces: Index) -> Any:
        """Colours (m, 3, 3) of corners in sRGB, from 0 to 1; None if the primitive has none."""
        if (index := attributes.get("COLOR_0")) is None:
            return None
        width = WIDTHS.get(self._item("accessors", index).get("type", ""), 0)
        try:
            values = self._numbers(index, width)
            check_numbers(faces, len(values), "colours", self._path)
        except InputError:
            # A mesh is sound without colours.
            return None
        if width not in (3, 4):
            return None
        largest = np.iinfo(values.dtype).max if values.dtype.kind in "iu" else 1.0
        # glTF states colours in linear light.
        return srgb((values[:, :3] / largest).astype(np.float32), 1.0)[faces]

    def _numbers(self, index: int, width: int) -> Any:
        """Values (count, width) of an accessor, or (count,) of width 1."""
        accessor = self._item("accessors", index)
        count, kind = int(accessor["count"]), np.dtype(TYPES[accessor["componentType"]])
        check_count(count, "values of an accessor", self._path, MOST_VERTICES)
        if WIDTHS.get(accessor["type"]) != width or "sparse" in accessor or "bufferView" not in accessor:
            raise InputError(f"{self._path}: accessor {index}: is sparse, empty or of an unknown type")
        view = self._item("bufferViews", accessor["bufferView"])
        if view.get("buffer", 0) != 0 or "uri" in self._document.get("buffers", [{}])[0]:
            raise InputError(f"{self._path}: accessor {index}: lies in another file; save it all in one GLB")
        start = int(view.get("byteOffset", 0)) + int(accessor.get("byteOffset", 0))
        stride = int(view.get("byteStride", kind.itemsize * width))
        needed = start + stride * (count - 1) + kind.itemsize * width
        if min(start, count - 1) < 0 or stride < kind.itemsize * width or needed > len(self._binary):
            raise InputError(f"{self._path}: accessor {index}: reaches beyond the file")
        values = np.ndarray((count, width), kind, self._binary, start, (stride, kind.itemsize))
        return values[:, 0] if width == 1 else values

    def joined(self) -> Parsed:
        """All meshes as one; texture coordinates, colours and normals only if all have them."""
        if not self._shown:
            raise InputError(f"{self._path}: shows no triangles")
        vertices, faces, uv, colours, normals = (
            None if any(each is None for each in values) else np.concatenate(values)
            for values in zip(*self._shown, strict=True)
        )
        pieces = tuple(self._pieces)
        return Parsed(vertices, faces, uv, UNITS["m"], colours=colours, pieces=pieces, normals=normals)


def _triangles(corners: Index, mode: int) -> Index:
    """(m, 3) corners of a primitive of a mode."""
    if mode == TRIANGLES:
        return corners.reshape(-1, 3)
    if len(corners) < 3:
        return np.zeros((0, 3), dtype=np.int64)
    if mode == FAN:
        return np.stack([np.full(len(corners) - 2, corners[0]), corners[1:-1], corners[2:]], axis=1)
    faces = np.lib.stride_tricks.sliding_window_view(corners, 3).copy()
    # Every second triangle of a strip runs the other way.
    faces[1::2] = faces[1::2, [0, 2, 1]]
    return faces


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
