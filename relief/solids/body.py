"""Bodies of triangles, and parts: bodies with a name, a placement and colours."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from relief.ground.arrays import AnyArray, Array, Index, renumbered

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""A triangle in a binary STL file, for reader and writer."""


class Body(NamedTuple):
    """A closed body.

    Attributes:
        vertices: (vertices, 3) mm.
        faces: (faces, 3) numbers of vertices, counter-clockwise seen from outside.
    """

    vertices: Array
    faces: Index

    @property
    def normals(self) -> Array:
        """(faces, 3) outward normals of the faces, as long as twice their area, mm²."""
        a, b, c = np.moveaxis(self.vertices[self.faces], 1, 0)
        return np.cross(b - a, c - a)

    @property
    def areas(self) -> Array:
        """(faces,) areas of the faces, mm²."""
        return np.asarray(0.5 * np.linalg.norm(self.normals, axis=1))

    def part(self, some: AnyArray | slice) -> "Body":
        """Some of the faces, by their numbers or by a mask, with the vertices that they use alone."""
        used, faces = renumbered(self.faces[some], len(self.vertices))
        return Body(self.vertices[used], faces)


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
