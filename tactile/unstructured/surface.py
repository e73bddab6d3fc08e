"""Surfaces of soft skin, closed: a flat block, a rounded fingertip, or any other triangle mesh.

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
LEAST_RIM_MM = 0.15
"""Least thickness of skin at a fingertip's corners, mm: with less, no body is left to mesh."""
CAP_STEP_MM = 0.25
"""Side of a cap's triangles, mm: their chords lie at most 0.25² / (4 x 8) = 2 µm inside a radius of 8 mm."""

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


def block_surface(size_mm: float, thickness_mm: float) -> ClosedSurface:
    """Surface of the flat soft block, `size_mm` a side, whose top is bonded."""
    half = 0.5 * size_mm
    return _prism(np.array([-half, half]), np.zeros((2, 2)), thickness_mm)


def fingertip_surface(size_mm: float, thickness_mm: float, radius_mm: float) -> ClosedSurface:
    """Surface of a block whose lower face is a cap of a sphere that touches the plane z = 0 in the middle.

    Args:
        size_mm: side of the block.
        thickness_mm: height of the flat, bonded top.
        radius_mm: of the sphere; 8-15 mm is a fingertip.

    Raises:
        InputError: the sphere does not reach the corners, or leaves less than `LEAST_RIM_MM` there.
    """
    half = 0.5 * size_mm
    corner = np.sqrt(2.0) * half
    if not (np.isfinite(radius_mm) and radius_mm > corner):
        raise InputError(f"radius_mm: {radius_mm} must be more than {corner:.3g}, half the diagonal")
    sag = radius_mm - np.sqrt(radius_mm**2 - corner**2)
    if sag > thickness_mm - LEAST_RIM_MM:
        raise InputError(
            f"radius_mm: {radius_mm} raises the corners by {sag:.3g} mm of the {thickness_mm} mm of skin"
        )
    line = np.linspace(-half, half, 2 * int(np.ceil(half / CAP_STEP_MM)) + 1)
    square = line[:, None] ** 2 + line[None, :] ** 2
    return _prism(line, radius_mm - np.sqrt(radius_mm**2 - square), thickness_mm)


def _prism(line: Array, bottom: Array, top: float) -> ClosedSurface:
    """Surface of the body between heights `bottom` (n, n) over a square grid and the plane z = top."""
    n = line.size
    x, y = np.meshgrid(line, line, indexing="ij")
    lower, upper = (np.stack((x, y, np.broadcast_to(z, x.shape)), axis=-1) for z in (bottom, top))
    number = np.arange(n * n).reshape(n, n)
    quads = np.stack((number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]), -1).reshape(-1, 4)
    rim = np.concatenate((number[0, :-1], number[:-1, -1], number[-1, :0:-1], number[:0:-1, 0]))
    following = np.roll(rim, -1)
    above = n * n
    walls = np.stack((following, rim, rim + above, following + above), axis=1)
    faces = np.concatenate((quads, quads[:, ::-1] + above, walls))
    triangles = np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]))
    return ClosedSurface(np.concatenate((lower, upper)).reshape(-1, 3), triangles)
