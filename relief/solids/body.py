"""Bodies of triangles, and the files that hold one without a name: binary STL and binary PLY."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array, in_blocks

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle in a binary STL file."""
FACE = np.dtype([("count", "u1"), ("vertices", "<i4", 3)])
"""A face in a binary PLY file."""


class Body(NamedTuple):
    """A closed body.

    Attributes:
        vertices: (vertices, 3) mm.
        faces: (faces, 3) numbers of vertices, counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.intp]

    @property
    def normals(self) -> Array:
        """(faces, 3) outward normals of the faces, as long as twice their area, mm²."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        return np.cross(b - a, c - a)

    @property
    def areas(self) -> Array:
        """(faces,) areas of the faces, mm²."""
        return np.asarray(0.5 * np.linalg.norm(self.normals, axis=1))


@dataclass(frozen=True)
class Part:
    """A body in a file of several.

    Attributes:
        name: As a slicer or a modelling program shows it.
        body: In mm.
        placement: (4, 3), invertible, for row vectors: a point p of the body lies at
            p @ placement[:3] + placement[3], mm. None leaves the body where it is.
        colours: (vertices, 3) red, green and blue in sRGB, from 0 to 1; None for a body without. GLB alone
            keeps them.
    """

    name: str
    body: Body
    placement: Array | None = None
    colours: Array | None = None

    @property
    def placed(self) -> Body:
        """The body at its place; faces are turned over where the placement is a mirror image."""
        if self.placement is None:
            return self.body
        turn = self.placement[:3]
        faces = self.body.faces if np.linalg.det(turn) > 0.0 else self.body.faces[:, ::-1]
        return Body(self.body.vertices @ turn + self.placement[3], faces)


def joined(parts: Sequence[Part]) -> Body:
    """All parts at their places as one body of several pieces."""
    bodies = [part.placed for part in parts]
    if len(bodies) == 1:
        return bodies[0]
    first = np.cumsum([0, *(len(body.vertices) for body in bodies)])
    faces = [body.faces + number for body, number in zip(bodies, first, strict=False)]
    return Body(np.concatenate([body.vertices for body in bodies]), np.concatenate(faces))


def stl(body: Body) -> bytes:
    """A body as a binary STL file."""
    return b"".join(stl_blocks(body))


def stl_blocks(body: Body) -> Iterator[bytes]:
    """The bytes of a binary STL file, one block after the other."""
    yield b"Retouch".ljust(80) + np.uint32(len(body.faces)).tobytes()
    for faces in in_blocks(body.faces):
        triangles = np.zeros(len(faces), TRIANGLE)
        normal = Body(body.vertices, faces).normals
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        triangles["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
        triangles["corners"] = body.vertices[faces]
        yield triangles.tobytes()


def ply(body: Body) -> bytes:
    """A body as a binary PLY file."""
    return b"".join(ply_blocks(body))


def ply_blocks(body: Body) -> Iterator[bytes]:
    """The bytes of a binary PLY file, one block after the other."""
    yield (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(body.vertices)}\n"
        "property float x\nproperty float y\nproperty float z\n"
        f"element face {len(body.faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    ).encode()
    for vertices in in_blocks(body.vertices):
        yield vertices.astype("<f4").tobytes()
    for corners in in_blocks(body.faces):
        faces = np.zeros(len(corners), FACE)
        faces["count"], faces["vertices"] = 3, corners
        yield faces.tobytes()
