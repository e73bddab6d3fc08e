"""Normals of the plate's triangles, for the tests of the grid and of the plugin that renders them."""

import numpy as np
from numpy.typing import NDArray

from relief import plate_grid as grid


def face_normals(heights: NDArray[np.float64], size_mm: float) -> NDArray[np.float64]:
    """(faces, 3) upward normals of the plate's triangles; their length is twice the area, mm²."""
    rows, cols = heights.shape
    x, y = grid.grid_vertices(rows, cols, size_mm)
    vertices = np.stack([x, y, heights.ravel()[grid.pad_index(rows, cols)]], axis=-1)
    a, b, c = (vertices[corner] for corner in grid.grid_faces(rows, cols).T)
    return np.cross(b - a, c - a)
