"""Surfaces of soft skin, closed: any triangle mesh with a flat top.

Axes are (x, y, z): x to the right and y to the top of the picture, from the middle of the touched square; z
up from the lowest point of the skin (0) to its flat top, which is bonded to the bone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from relief.ground.arrays import Array
from relief.ground.errors import InputError

DOWNWARD = 0.3
"""Least downward component of the outward unit normal of faces that may touch the texture; sides have 0."""
INSIDE = 1e-6
"""Tolerance on barycentric coordinates: a point lies in a simplex if none is below minus this (rounding)."""


@dataclass(frozen=True)
class ClosedSurface:
    """A closed triangle mesh.

    Attributes:
        vertices: (n, 3) mm.
        triangles: (m, 3) vertex indices, counter-clockwise seen from outside.

    Raises:
        InputError: empty, not finite, a vertex number out of range, not closed, or inside out.
    """

    vertices: Array
    triangles: NDArray[np.int64]

    def __post_init__(self) -> None:
        for name, table in (("vertices", self.vertices), ("triangles", self.triangles)):
            if table.ndim != 2 or table.shape[1] != 3 or len(table) == 0:
                raise InputError(f"surface.{name}: shape {table.shape} is not (n, 3) with n > 0")
        if not np.isfinite(self.vertices).all():
            raise InputError("surface.vertices: not every value is finite")
        if self.triangles.min() < 0 or self.triangles.max() >= len(self.vertices):
            raise InputError(f"surface.triangles: a number is outside [0, {len(self.vertices) - 1}]")
        edges = np.concatenate([self.triangles[:, pair] for pair in ([0, 1], [1, 2], [2, 0])])
        number = len(self.vertices)
        forth, back = edges[:, 0] * number + edges[:, 1], edges[:, 1] * number + edges[:, 0]
        open_edges = np.setxor1d(forth, back).size
        if open_edges or np.unique(forth).size < forth.size:
            raise InputError(
                f"surface.triangles: not closed, or turned different ways ({open_edges} edges do not pair up)"
            )
        if self.volume_mm3 <= 0.0:
            raise InputError("surface.triangles: inside out; list vertices counter-clockwise from outside")

    @property
    def volume_mm3(self) -> float:
        """Volume inside the surface."""
        a, b, c = (self.vertices[column] for column in self.triangles.T)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    @property
    def top_mm(self) -> float:
        """Height of the bonded face."""
        return float(self.vertices[:, 2].max())

    def contact_face(self) -> NDArray[np.int64]:
        """(k, 3) triangles that may touch: `lower_face`.

        Raises:
            InputError: none does.
        """
        face = lower_face(self.vertices, self.triangles)
        if len(face) == 0:
            raise InputError("surface.triangles: none looks down (-z), so none can touch the texture")
        return face

    def lower_height(self, x: Array, y: Array) -> Array:
        """Height (mm) of the contact face over points of any shape; beside it, of the nearest vertex."""
        return height_over(self.vertices, self.contact_face(), x, y)


def lower_face(vertices: Array, triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 3) triangles that face downward and are connected with the lowest one; none where none does.

    Ceilings of bores and grooves look down as well, and never touch.
    """
    down = triangles[outward_normals(vertices, triangles)[:, 2] < -DOWNWARD]
    if len(down) == 0:
        return down
    edges = np.concatenate((down[:, :2], down[:, 1:]))
    graph = coo_matrix((np.ones(len(edges), np.int8), edges.T), (len(vertices),) * 2)
    part = connected_components(graph, directed=False)[1][down[:, 0]]
    return np.asarray(down[part == part[vertices[down, 2].min(axis=1).argmin()]])


def outward_normals(vertices: Array, triangles: NDArray[np.integer]) -> Array:
    """(m, 3) unit normals of triangles that are counter-clockwise seen from outside."""
    a, b, c = (vertices[column] for column in triangles.T)
    normals = np.cross(b - a, c - a)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def height_over(vertices: Array, triangles: NDArray[np.integer], x: Array, y: Array) -> Array:
    """Height of triangles that form a graph over the (x, y) plane, at points of any shape.

    Points that no triangle covers take the height of the nearest vertex.
    """
    corners = vertices[triangles]
    points = np.stack((np.ravel(x), np.ravel(y)), axis=1)
    where, weights = locate(corners[..., :2], points)
    height = np.einsum("ij,ij->i", weights, corners[where, :, 2])
    outside = where < 0
    lowest = vertices[np.unique(triangles)]
    height[outside] = lowest[KDTree(lowest[:, :2]).query(points[outside])[1], 2]
    return height.reshape(np.shape(x))


def locate(corners: Array, points: Array) -> tuple[NDArray[np.intp], Array]:
    """Index and barycentric coordinates of the simplex that each point lies in.

    Args:
        corners: (m, d + 1, d) triangles (d = 2) or tetrahedra (d = 3).
        points: (k, d).

    Returns:
        (k,) index of the simplex, -1 outside all; (k, d + 1) barycentric coordinates.
    """
    centre = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
    near = KDTree(points).query_ball_point(centre, reach * (1.0 + 1e-9))
    simplex = np.repeat(np.arange(len(near)), [len(points_near) for points_near in near])
    point = np.concatenate([np.asarray(points_near, dtype=np.intp) for points_near in near])
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    flat = np.abs(np.linalg.det(edges)) < 1e-14
    edges[flat] = np.inf  # nothing lies in a simplex without content
    inverse = np.zeros_like(edges)
    inverse[~flat] = np.linalg.inv(edges[~flat])
    rest = np.einsum("ijk,ik->ij", inverse[simplex], points[point] - corners[simplex, 0])
    weights = np.concatenate((1.0 - rest.sum(axis=1, keepdims=True), rest), axis=1)
    deepest = np.where(flat[simplex], -np.inf, weights.min(axis=1))
    # The last entry of each point in ascending order is the simplex it lies deepest in.
    order = np.lexsort((deepest, point))
    last = order[np.flatnonzero(np.diff(point[order], append=len(points)))]
    last = last[deepest[last] >= -INSIDE]
    indices, barycentric = np.full(len(points), -1), np.zeros((len(points), corners.shape[1]))
    indices[point[last]], barycentric[point[last]] = simplex[last], weights[last]
    return indices, barycentric
