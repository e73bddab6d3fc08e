"""Readers of STL, OBJ and PLY, whose counts are checked before trimesh reads them."""

import io
import re
from pathlib import Path

import numpy as np

from relief.body import TRIANGLE
from relief.common.errors import InputError
from relief.meshes.parsed import MOST_FACES, Parsed

MOST_VERTICES = 3 * MOST_FACES
"""Most vertices of a PLY or OBJ; more cannot all be corners."""
STL_HEAD = 84
"""Bytes before the triangles of a binary STL file: a comment, and the number of triangles."""


def read_stl(content: bytes, path: Path) -> Parsed:
    """Read a binary or ASCII STL. Raises InputError."""
    count = int.from_bytes(content[80:STL_HEAD], "little")
    if len(content) >= STL_HEAD and STL_HEAD + count * TRIANGLE.itemsize == len(content):
        check_count(count, "triangles", path)
        corners = np.frombuffer(content, TRIANGLE, count, STL_HEAD)["corners"].astype(np.float64)
    elif content.lstrip()[:5].lower() == b"solid" and b"vertex" in content:
        check_count(content.count(b"vertex") // 3, "triangles", path)
        numbers = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", content)
        if len(numbers) % 3:
            raise InputError(f"{path}: damaged: {len(numbers)} vertices do not make whole triangles")
        corners = np.array(numbers, dtype=np.float64)
    else:
        held = max((len(content) - STL_HEAD) // TRIANGLE.itemsize, 0)
        raise InputError(f"{path}: damaged: the header tells {count} triangles, the file holds {held}")
    corners = corners.reshape(-1, 3)
    return Parsed(corners, np.arange(len(corners)).reshape(-1, 3))


def read_obj(content: bytes, path: Path) -> Parsed:
    """Read an OBJ with its texture coordinates; what it says of materials is passed over."""
    for word, most in ((b"\nv ", MOST_VERTICES), (b"\nf ", MOST_FACES)):
        check_count(content.count(word), word.decode().strip() + " lines", path, most)
    lines = re.sub(rb"(?m)^(mtllib|usemtl)\b.*$", b"", content)
    return _by_trimesh(lines, "obj", path)


def read_ply(content: bytes, path: Path) -> Parsed:
    """Read a PLY of faces, binary or ASCII. Raises InputError."""
    head, end, _ = content[: 1 << 16].partition(b"end_header")
    if not end or not head.startswith(b"ply"):
        raise InputError(f"{path}: damaged or not a PLY: has no header")
    counts = {name.decode(): int(count) for name, count in re.findall(rb"element\s+(\w+)\s+(\d+)", head)}
    for name, count in counts.items():
        check_count(count, f"elements {name}", path, MOST_VERTICES if name == "vertex" else MOST_FACES)
        if count > len(content):
            raise InputError(f"{path}: damaged: the header tells {count} elements {name} in a shorter file")
    return _by_trimesh(content, "ply", path)


def check_count(count: int, of: str, path: Path, most: int = MOST_FACES) -> None:
    """Raise InputError if a file says that it has more of something than is read."""
    if count > most:
        raise InputError(f"{path}: has {count} {of}; at most {most} are read: decimate the mesh")


def _by_trimesh(content: bytes, kind: str, path: Path) -> Parsed:
    # Imported here, because it takes half a second.
    import trimesh

    mesh = trimesh.load(io.BytesIO(content), file_type=kind, process=False, force="mesh")
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise InputError(f"{path}: has no triangles; a mesh of triangles is needed, no points or curves")
    faces = np.asarray(mesh.faces)
    uv = getattr(mesh.visual, "uv", None)
    if uv is not None and np.shape(uv) == (len(mesh.vertices), 2) and faces.min() >= 0:
        uv = np.asarray(uv)[faces] if faces.max() < len(mesh.vertices) else None
    else:
        uv = None
    return Parsed(np.asarray(mesh.vertices), faces, uv)
