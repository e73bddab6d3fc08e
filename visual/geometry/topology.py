"""Topology of the plate: triangles, their slopes, which are linear in the heights, and silhouettes."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from relief import plate_grid as grid
from relief.ground.arrays import Array, Index
from relief.plate_grid import NO_HALO, Halo


@dataclass(frozen=True)
class PlateTopology:
    """The plate's mesh without its heights.

    Attributes:
        rows, cols: of the height samples.
        size_mm: width of the plate, along x.
        halo: samples of the neighbours beyond each side, along y and x; see `relief.plate_grid`.
        x, y: (vertices,) mm.
        sample: (vertices,) number of the height sample that each vertex carries.
        faces: (faces, 3) vertices.
        slope_x, slope_y: (faces, 3) 1/mm: dz/dx and dz/dy of a face are the products of these coefficients
            with the heights of its vertices.
        edge_start, edge_end: (edges,) vertices.
        edge_left, edge_right: (edges,) faces, -1 beyond the border.
    """

    rows: int
    cols: int
    size_mm: float
    halo: Halo
    x: Array
    y: Array
    sample: Index
    faces: Index
    slope_x: Array
    slope_y: Array
    edge_start: Index
    edge_end: Index
    edge_left: Index
    edge_right: Index

    @property
    def height_mm(self) -> float:
        """Extent of the plate along y, mm."""
        return self.size_mm * (self.rows / self.cols)

    @property
    def cells(self) -> tuple[int, int]:
        """Rows and columns of the cells, each of two faces."""
        down, across = grid.vertex_shape(self.rows, self.cols, self.halo)
        return down - 1, across - 1

    def shows(self, x: Array, y: Array) -> NDArray[np.bool_]:
        """Whether points (points,), mm, lie on the plate itself, not on a neighbour."""
        return (np.abs(x) <= 0.5 * self.size_mm) & (np.abs(y) <= 0.5 * self.height_mm)

    def vertex_heights(self, heights: Array) -> Array:
        """Heights (vertices,), mm, of the vertices, from those of the samples (rows, cols)."""
        return heights.ravel()[self.sample]

    def slopes(self, heights: Array) -> tuple[Array, Array]:
        """Slopes dz/dx and dz/dy of the faces, each (faces,), at heights (rows, cols), mm."""
        z = self.vertex_heights(heights)[self.faces]
        return (self.slope_x * z).sum(1), (self.slope_y * z).sum(1)


@lru_cache(maxsize=4)
def plate_topology(rows: int, cols: int, size_mm: float, halo: Halo = NO_HALO) -> PlateTopology:
    """The topology of a plate of `rows` x `cols` height samples, a width of `size_mm` and a halo."""
    x, y = grid.grid_vertices(rows, cols, size_mm, halo)
    faces = grid.grid_faces(rows, cols, halo).astype(np.int64)
    fx, fy = x[faces], y[faces]
    # Gradients of the barycentric coordinates of each face.
    twice_area = (fx[:, 1] - fx[:, 0]) * (fy[:, 2] - fy[:, 0]) - (fx[:, 2] - fx[:, 0]) * (fy[:, 1] - fy[:, 0])
    following, last = [1, 2, 0], [2, 0, 1]
    slope_x = (fy[:, following] - fy[:, last]) / twice_area[:, None]
    slope_y = (fx[:, last] - fx[:, following]) / twice_area[:, None]
    start, end, left, right = (part.astype(np.int64) for part in grid.edges(rows, cols, halo))
    sample = grid.pad_index(rows, cols, halo).astype(np.int64)
    shape = rows, cols, size_mm, halo
    return PlateTopology(*shape, x, y, sample, faces, slope_x, slope_y, start, end, left, right)


def silhouettes(plate: PlateTopology, slope_x: Array, slope_y: Array, toward: Array) -> Index:
    """Convex edges between a face that looks toward the light and one that looks away.

    Beyond the border the plate falls away: an edge there counts if its only face looks away from the light.

    Args:
        plate: whose edges these are.
        slope_x, slope_y: (faces,) dz/dx and dz/dy.
        toward: (3,) unit vector toward the light, or one for each face (faces, 3).

    Returns:
        Numbers of edges.
    """
    x, y, z = np.asarray(toward).T
    lit = z - slope_x * x - slope_y * y > 0.0
    border = plate.edge_right < 0
    left_lit, right_lit = lit[plate.edge_left], np.where(border, True, lit[plate.edge_right])
    # Along a common edge slopes differ only across it; the ridge is where the slope falls from left to right.
    across_x = plate.y[plate.edge_end] - plate.y[plate.edge_start]
    across_y = plate.x[plate.edge_start] - plate.x[plate.edge_end]
    bend = (slope_x[plate.edge_right] - slope_x[plate.edge_left]) * across_x
    bend += (slope_y[plate.edge_right] - slope_y[plate.edge_left]) * across_y
    return np.flatnonzero((left_lit != right_lit) & (border | (bend < 0.0)))
