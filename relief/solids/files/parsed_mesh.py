"""The content of a file of a mesh before checks, the limits of readers, and the triangles of polygons."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array, Flags, Index, runs
from relief.ground.errors import InputError

MOST_FACES = 4_000_000
"""Most faces of a mesh that is read; a plate of 1400 x 1400 samples has as many."""
MOST_VERTICES = 3 * MOST_FACES
"""Most vertices; more cannot all be corners."""
LARGEST_FILE = 1 << 29
"""Most bytes of a file, packed and unpacked; 4 million faces take 200 MB of STL and 300 MB of 3MF."""

LEAST_SHARE = 1e-9
"""Area of a triangle, as a share of its polygon, below which three corners lie on a line."""
MOST_EARS = 1_000_000_000
"""Most pairs of corners of concave polygons: the clipping of ears then takes up to ten seconds."""


@dataclass(frozen=True)
class Piece:
    """A part of a file, or a volume of a 3MF, at one of its places.

    Attributes:
        name: As a slicer or a modelling program shows it.
        first: Number of its first face, when the faces of all pieces are counted.
        path: Places of the item in the build, and of the components in what is above each.
        span: Number of its first triangle in the mesh of its object, and the number after the last.
        placement: (4, 3) of the mesh of its object, for row vectors, in the file's unit.
        cut: Path of what holds the negative volumes that are cut out of the piece; None: there are none.
    """

    name: str
    first: int
    path: tuple[int, ...] = ()
    span: tuple[int, int] = (0, 0)
    placement: Any = None
    cut: tuple[int, ...] | None = None


@dataclass(frozen=True)
class Parsed:
    """Content of a file.

    Attributes:
        vertices: (n, 3) in the file's unit, z up.
        faces: (m, 3) numbers of vertices.
        uv: (m, 3, 2) texture coordinates of corners, or None.
        colours: (m, 3, 3) red, green and blue of corners in sRGB, from 0 to 1, or None.
        unit_mm: mm of the file's unit; None where the format has none.
        warnings: lines about content that was left out.
        pieces: of the file, whose faces are counted one after the other; empty for one without a name.
        origin: (m,) number of the face of the file that each face lies in, -1 for none; None: its own number.
        normals: (m, 3, 3) outward unit normals of the exact surface at corners, or None.
    """

    vertices: Any
    faces: Any
    uv: Any = None
    unit_mm: float | None = None
    warnings: tuple[str, ...] = ()
    colours: Any = None
    pieces: "tuple[Piece, ...]" = ()
    origin: Any = None
    normals: Any = None


def check_count(count: int, what: str, path: Path, most: int = MOST_FACES) -> None:
    """Raise InputError if a file says that it has more of something than is read."""
    if count > most:
        raise InputError(f"{path}: has {count} {what}; at most {most} are read: decimate the mesh")


def check_numbers(numbers: Any, count: int, what: str, path: Path) -> None:
    """Raise InputError if faces name something that the file has too few of."""
    if numbers.size and not 0 <= numbers.min() <= numbers.max() < count:
        raise InputError(f"{path}: faces name {what} that the file does not have")


def triangulated(vertices: Array, corners: Index, lengths: Index, path: Path) -> Index:
    """Triangles of polygons, n - 2 of a polygon with n corners.

    A polygon becomes a fan around its first or second corner, if all triangles of the fan face the way of
    the polygon. Each convex polygon and each quadrilateral has such a fan. Manifold clips the ears of the
    other polygons in their mean planes.

    Args:
        vertices: (n, 3).
        corners: Numbers of vertices, one polygon after the other.
        lengths: (k,) numbers of corners of the polygons.
        path: Of the file, for messages.

    Returns:
        (m, 3) places in `corners`.

    Raises:
        InputError: A corner names no vertex, or concave polygons have too many corners.
    """
    count = np.maximum(lengths - 2, 0)
    polygon, after = runs(count, 1)
    first, begin = (np.cumsum(each) - each for each in (lengths, count))
    fans = np.stack([0 * after, after, after + 1], axis=1)
    places: Index = first[polygon][:, None] + fans
    check_numbers(corners[places], len(vertices), "vertices", path)
    doubtful = count > 1
    for around in (0, 1):
        rows = np.flatnonzero(doubtful[polygon])
        own = polygon[rows]
        turned = first[own][:, None] + (fans[rows] + around) % lengths[own][:, None]
        sound = ~np.isin(own, own[~_facing(vertices[corners[turned]], own)])
        places[rows[sound]] = turned[sound]
        doubtful[own[sound]] = False
    if (lengths[doubtful].astype(float) ** 2).sum() > MOST_EARS:
        most = lengths[doubtful].max()
        raise InputError(f"{path}: has concave polygons of up to {most} corners; triangulate the mesh")
    # Few files need Manifold, which takes time to load.
    from manifold3d import triangulate

    for number in np.flatnonzero(doubtful):
        start, end = first[number], first[number] + lengths[number]
        triangles = triangulate([_flat(vertices[corners[start:end]])])
        if len(triangles) == count[number]:
            places[begin[number] : begin[number] + count[number]] = start + triangles
    return places


def _facing(triangles: Array, polygon: Index) -> Flags:
    """(m,) whether triangles (m, 3, 3) face the way of their polygons, or have equal corners.

    Args:
        triangles: Corners, polygon by polygon.
        polygon: (m,) rising numbers of the polygons.
    """
    with np.errstate(all="ignore"):
        normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        new = np.diff(polygon, prepend=-1) != 0
        whole = np.add.reduceat(normals, np.flatnonzero(new))[np.cumsum(new) - 1] if len(new) else normals
        facing = (normals * whole).sum(axis=1) > LEAST_SHARE * (whole**2).sum(axis=1)
    return np.asarray(facing | (triangles == np.roll(triangles, 1, axis=1)).all(axis=2).any(axis=1))


def _flat(points: Array) -> Array:
    """(n, 2) corners of a polygon (n, 3) in its mean plane, counterclockwise; zeros if it has no area."""
    with np.errstate(all="ignore"):
        sides = points - points[0]
        normal = np.cross(sides, np.roll(sides, -1, axis=0)).sum(axis=0)
        normal /= np.linalg.norm(normal)
        across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
        across /= np.linalg.norm(across)
        return np.nan_to_num(sides @ np.stack([across, np.cross(normal, across)], axis=1))
