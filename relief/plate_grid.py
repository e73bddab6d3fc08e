"""Triangulation of the plate over the grid of its height samples.

Height samples sit at pixel centres. On an axis that ends, a ring of vertices that repeats the outermost
samples carries the plate to its sides. On an axis that repeats, a halo of samples from the neighbouring
repeats lies around the plate, so that light and shadow come in from the neighbours. The halo of an axis is
its number of samples beyond each side, 0 on an axis that ends.

The vertex grid is ``(rows + 2 max(1, halo of y), cols + 2 max(1, halo of x))``, row-major, row 0 at +y. The
cell with corners ``a = (i, j)``, ``b = (i, j + 1)``, ``c = (i + 1, j)``, ``d = (i + 1, j + 1)`` has the faces
``(a, c, b)`` and ``(b, c, d)``, in this order, counter-clockwise seen from +z. Lengths are mm.
"""

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array

Numbers = NDArray[np.int32]
"""Numbers of vertices, faces or height samples."""
Halo = tuple[int, int]
"""Samples of the neighbours beyond each side of the plate, along y and x."""
NO_HALO: Halo = (0, 0)


def vertex_shape(rows: int, cols: int, halo: Halo = NO_HALO) -> tuple[int, int]:
    """Return rows and columns of the vertices."""
    return rows + 2 * max(1, halo[0]), cols + 2 * max(1, halo[1])


def grid_axes(rows: int, cols: int, size_mm: float, halo: Halo = NO_HALO) -> tuple[Array, Array]:
    """Return the grid lines of the vertices.

    Args:
        rows: Height samples along y.
        cols: Height samples along x.
        size_mm: Width of the plate, along x, mm; the samples are square.
        halo: Samples beyond each side.

    Returns:
        ``x``, rising, and ``y``, falling, in mm, one for each column and row of vertices.
    """

    def across(samples: int, length_mm: float, beyond: int) -> Array:
        centres = (np.arange(-beyond, samples + beyond) + 0.5) / samples - 0.5
        return length_mm * (centres if beyond else np.concatenate(([-0.5], centres, [0.5])))

    return across(cols, size_mm, halo[1]), -across(rows, size_mm * (rows / cols), halo[0])


def grid_vertices(rows: int, cols: int, size_mm: float, halo: Halo = NO_HALO) -> tuple[Array, Array]:
    """Return ``x`` and ``y`` in mm of every vertex, each of shape ``(vertices,)``."""
    x, y = np.meshgrid(*grid_axes(rows, cols, size_mm, halo))
    return x.ravel(), y.ravel()


def pad_index(rows: int, cols: int, halo: Halo = NO_HALO) -> Numbers:
    """Return the flat index of each vertex's height sample, shape ``(vertices,)``."""

    def along(samples: int, beyond: int) -> Numbers:
        place = np.arange(-max(1, beyond), samples + max(1, beyond), dtype=np.int32)
        return place % samples if beyond else np.clip(place, 0, samples - 1)

    return (along(rows, halo[0])[:, None] * np.int32(cols) + along(cols, halo[1])).ravel()


def _corners(rows: int, cols: int, halo: Halo) -> Numbers:
    shape = vertex_shape(rows, cols, halo)
    return np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape)


def grid_faces(rows: int, cols: int, halo: Halo = NO_HALO) -> Numbers:
    """Return the vertices of the faces, shape ``(faces, 3)``; cell ``k`` has faces ``2k`` and ``2k + 1``."""
    vertex = _corners(rows, cols, halo)
    a, b, c, d = vertex[:-1, :-1], vertex[:-1, 1:], vertex[1:, :-1], vertex[1:, 1:]
    upper_left, lower_right = np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)
    return np.stack([upper_left, lower_right], axis=-2).reshape(-1, 3)


def edges(rows: int, cols: int, halo: Halo = NO_HALO) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return every edge once, with the faces beside it.

    Left and right of an edge are seen from +z in the direction from its start to its end. An edge on a side
    of the mesh has its face on the left and -1 on the right.

    Args:
        rows: Height samples along y.
        cols: Height samples along x.
        halo: Samples beyond each side.

    Returns:
        Start vertex, end vertex, left face and right face, each of shape ``(edges,)``; there are
        ``vertices + faces - 1`` edges.
    """
    vertex = _corners(rows, cols, halo)
    down, across = vertex.shape[0] - 1, vertex.shape[1] - 1
    first = 2 * np.arange(down * across, dtype=np.int32).reshape(down, across)
    second = first + 1

    def beside(faces: Numbers, pad: tuple[tuple[int, int], tuple[int, int]]) -> Numbers:
        return np.pad(faces, pad, constant_values=-1)

    before, after = (1, 0), (0, 1)
    none = (0, 0)
    rightward = (vertex[:, :-1], vertex[:, 1:], beside(second, (before, none)), beside(first, (after, none)))
    downward = (vertex[:-1, :], vertex[1:, :], beside(first, (none, after)), beside(second, (none, before)))
    diagonal = (vertex[1:, :-1], vertex[:-1, 1:], first, second)
    start, end, left, right = (
        np.concatenate([part.ravel() for part in parts])
        for parts in zip(rightward, downward, diagonal, strict=True)
    )
    flipped = left < 0
    start, end = np.where(flipped, end, start), np.where(flipped, start, end)
    left, right = np.where(flipped, right, left), np.where(flipped, left, right)
    return start, end, left, right


def flat_positions(rows: int, cols: int, size_mm: float, halo: Halo = NO_HALO) -> NDArray[np.float32]:
    """Return interleaved ``x, y, z`` in mm of the vertices of a plate at z = 0, shape ``(3 * vertices,)``."""
    x, y = grid_vertices(rows, cols, size_mm, halo)
    return np.stack([x, y, np.zeros_like(x)], axis=-1).astype(np.float32).ravel()


def texture_coordinates(rows: int, cols: int, halo: Halo = NO_HALO) -> NDArray[np.float32]:
    """Return interleaved ``u, v`` of the vertices, u along x and v along y, shape ``(2 * vertices,)``.

    On the plate both go from 0 to 1.
    """
    x, y = grid_vertices(rows, cols, 1.0, halo)
    return (np.stack((x, y * (cols / rows)), axis=-1) + 0.5).astype(np.float32).ravel()
