"""Triangulation of the plate over the grid of its height samples.

Height samples sit at pixel centres; a ring of vertices that repeats the outermost samples carries the plate
to its sides, so the vertex grid is ``(rows + 2, cols + 2)``, row-major, row 0 at ``y = +size / 2``. The cell
with corners ``a = (i, j)``, ``b = (i, j + 1)``, ``c = (i + 1, j)``, ``d = (i + 1, j + 1)`` has the faces
``(a, c, b)`` and ``(b, c, d)``, in this order, counter-clockwise seen from +z. Lengths are mm.
"""

import numpy as np
from numpy.typing import NDArray


def grid_axes(rows: int, cols: int, size_mm: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the grid lines of the vertices.

    Args:
        rows: Height samples along y.
        cols: Height samples along x.
        size_mm: Side of the plate, mm.

    Returns:
        ``x`` of shape ``(cols + 2,)``, rising, and ``y`` of shape ``(rows + 2,)``, falling, in mm.
    """

    def across(samples: int) -> NDArray[np.float64]:
        centres = (np.arange(samples) + 0.5) / samples - 0.5
        return size_mm * np.concatenate(([-0.5], centres, [0.5]))

    return across(cols), -across(rows)


def grid_vertices(rows: int, cols: int, size_mm: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ``x`` and ``y`` in mm of every vertex, each of shape ``((rows + 2) * (cols + 2),)``."""
    x, y = np.meshgrid(*grid_axes(rows, cols, size_mm))
    return x.ravel(), y.ravel()


def pad_index(rows: int, cols: int) -> NDArray[np.int32]:
    """Return the flat index of each vertex's height sample, shape ``((rows + 2) * (cols + 2),)``."""
    samples = np.arange(rows * cols, dtype=np.int32).reshape(rows, cols)
    return np.pad(samples, 1, mode="edge").ravel()


def _corners(rows: int, cols: int) -> NDArray[np.int32]:
    return np.arange((rows + 2) * (cols + 2), dtype=np.int32).reshape(rows + 2, cols + 2)


def grid_faces(rows: int, cols: int) -> NDArray[np.int32]:
    """Return the vertices of the faces, shape ``(faces, 3)``; cell ``k`` has faces ``2k`` and ``2k + 1``."""
    vertex = _corners(rows, cols)
    a, b, c, d = vertex[:-1, :-1], vertex[:-1, 1:], vertex[1:, :-1], vertex[1:, 1:]
    upper_left, lower_right = np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)
    return np.stack([upper_left, lower_right], axis=-2).reshape(-1, 3)


def edges(
    rows: int, cols: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Return every edge once, with the faces beside it.

    Left and right of an edge are seen from +z in the direction from its start to its end. An edge on a side
    of the plate has its face on the left and -1 on the right.

    Args:
        rows: Height samples along y.
        cols: Height samples along x.

    Returns:
        Start vertex, end vertex, left face and right face, each of shape ``(edges,)``; there are
        ``vertices + faces - 1`` edges.
    """
    vertex = _corners(rows, cols)
    first = 2 * np.arange((rows + 1) * (cols + 1), dtype=np.int32).reshape(rows + 1, cols + 1)
    second = first + 1

    def beside(faces: NDArray[np.int32], pad: tuple[tuple[int, int], tuple[int, int]]) -> NDArray[np.int32]:
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


def flat_positions(rows: int, cols: int, size_mm: float) -> NDArray[np.float32]:
    """Return interleaved ``x, y, z`` in mm of the vertices of a plate at z = 0, shape ``(3 * vertices,)``."""
    x, y = grid_vertices(rows, cols, size_mm)
    return np.stack([x, y, np.zeros_like(x)], axis=-1).astype(np.float32).ravel()


def texture_coordinates(rows: int, cols: int) -> NDArray[np.float32]:
    """Return interleaved ``u, v`` of the vertices, u along x and v along y, shape ``(2 * vertices,)``."""
    return (np.stack(grid_vertices(rows, cols, 1.0), axis=-1) + 0.5).astype(np.float32).ravel()
