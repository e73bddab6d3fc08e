"""Unrolling: the texture on an object as heights over a plane, without the object's own curvature.

Each point of the textured mesh has a foot, the nearest point on the object without texture, and a height
over it. Around a place the object is unrolled by its logarithmic map, which keeps directions and distances
from the place, and the heights stand over the unrolled feet.
"""

import numpy as np
import potpourri3d
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, flagged, renumbered, units
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.mesh_places import Frame, frame_along, vertex_normals
from relief.solids.meshes.neighbourhood import connected_around, edge_pairs, nearest_in, ways_from

REACH_MM = 9.0
"""Distance from a place up to which the object is unrolled, mm: the corners of a patch and a margin."""
CANDIDATES = 16
"""Faces of the object, the nearest by their middles, that are candidates for a foot."""
TEXTURED_MM = 1e-3
"""Least height over the object, mm, of texture; less is rounding."""
BARE_MM = 1.25
"""Distance from any texture, mm, from which the object is bare: gaps in a tile of dots reach 1.05 mm."""
SHARP = np.cos(np.radians(40.0))
"""Cosine between the normals of two faces, below which the edge between them is sharp."""


class Unroller:
    """Unrolls a textured mesh around places on its object.

    Attributes:
        object: The object, fine enough.
        farthest_mm: Largest distance of the textured mesh from the object, mm.
        bare: (vertices,) whether no texture is near a vertex of the object.
        sharp: (vertices,) whether a vertex of the object lies on a sharp edge.
        to_bare, to_sharp: (vertices,) ways along edges to such vertices, mm; infinite beyond `REACH_MM`.
    """

    @stage("measuring the distance from the object")
    def __init__(self, textured: Body, base: Body) -> None:
        self.object = base
        self._textured = textured
        self._normals = vertex_normals(base)
        self._face, self._shares = feet(textured.vertices, base)
        foot = np.einsum("nc,ncd->nd", self._shares, base.vertices[base.faces[self._face]])
        normal = np.einsum("nc,ncd->nd", self._shares, self._normals[base.faces[self._face]])
        away = textured.vertices - foot
        self._heights = np.linalg.norm(away, axis=1) * np.sign(np.einsum("nd,nd->n", away, normal))
        self.farthest_mm = float(np.abs(self._heights).max())
        self._tree = cKDTree(base.vertices)
        self.bare = np.ones(len(base.vertices), bool)
        if len(feet_of_texture := foot[np.abs(self._heights) > TEXTURED_MM]):
            self.bare = cKDTree(feet_of_texture).query(base.vertices)[0] > BARE_MM
        pairs = edge_pairs(base.faces)
        turned = pairs[np.einsum("nd,nd->n", *units(base.normals)[pairs.T // 3]) < SHARP, 0]
        corners = np.stack([turned, turned + 1]) % 3
        self.sharp = flagged(base.faces[turned // 3, corners], len(base.vertices))
        self.to_bare = ways_from(base, self.bare, REACH_MM)
        self.to_sharp = ways_from(base, self.sharp, REACH_MM)

    def frame(self, near: Array) -> tuple[int, Frame]:
        """Number and frame of the object's vertex nearest to a point."""
        vertex = int(self._tree.query(near)[1])
        return vertex, frame_along(self.object.vertices[vertex], self._normals[vertex])

    def flat(self, vertex: int, frame: Frame) -> Array:
        """Places (vertices, 2) of the object's vertices around one of them in the axes of its frame, mm.

        NaN where they are farther away than `REACH_MM` or not connected.
        """
        numbers, faces = self._around(vertex, frame)
        solver = potpourri3d.MeshVectorHeatSolver(self.object.vertices[numbers], faces)
        start = int(np.searchsorted(numbers, vertex))
        towards_x, towards_y, _ = solver.get_tangent_frames()
        basis = np.stack([towards_x[start], towards_y[start]]) @ frame.axes[:2].T
        flat = np.full((len(self.object.vertices), 2), np.nan)
        flat[numbers] = solver.compute_log_map(start) @ basis
        flat[numbers[np.linalg.norm(flat[numbers], axis=1) > REACH_MM]] = np.nan
        return flat

    def laid(self, flat: Array) -> tuple[Index, Array, Index]:
        """Where the vertices of the textured mesh come to lie, by the places of the object's vertices.

        Returns:
            (k,) numbers of the vertices, their (k, 2) places, mm, and the (m, 3) faces between them, by their
            places among the k.
        """
        # Coordinates are worked out only where there are any: a textured mesh may have a million faces.
        mapped = np.asarray(np.isfinite(flat).all(axis=1))[self.object.faces].all(axis=1)
        a, b, c = np.asarray(mapped)[self._face][self._textured.faces.T]
        used, faces = renumbered(self._textured.faces[a & b & c], len(self._textured.vertices))
        at = np.einsum("nc,ncd->nd", self._shares[used], flat[self.object.faces[self._face[used]]])
        return used, at, faces

    def unrolled(self, flat: Array) -> Body:
        """The textured mesh as (x, y, height) by the places of the object's vertices, mm."""
        used, at, faces = self.laid(flat)
        return Body(np.column_stack([at, self._heights[used]]), faces)

    def _around(self, vertex: int, frame: Frame) -> tuple[Index, Index]:
        """Vertices of the object around one of them, rising, and the faces between them, by their places."""
        around = self._tree.query_ball_point(self.object.vertices[vertex], REACH_MM)
        near = flagged(np.array(around), len(self.object.vertices))
        faces = self.object.faces[near[self.object.faces].all(axis=1)]
        faces = connected_around(faces, vertex, len(near))
        return renumbered(faces, len(near))


def feet(points: Array, body: Body) -> tuple[Index, Array]:
    """The nearest point of a body to each of some points.

    Args:
        points: (n, 3) mm.
        body: Of small faces.

    Returns:
        (n,) faces, and (n, 3) barycentric coordinates in them.
    """
    corners = body.vertices[body.faces]
    count = min(CANDIDATES, len(corners))
    middles = corners.mean(axis=1)
    wide = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
    far, near = (found.reshape(len(points), -1) for found in cKDTree(middles).query(points, k=count))
    best = np.full(len(points), np.inf)
    face, shares = np.zeros(len(points), dtype=np.int64), np.zeros((len(points), 3))
    for distance, candidate in zip(far.T, near.T, strict=True):
        # No point of a face is nearer than its middle by more than its width.
        rows = np.flatnonzero(distance - wide[candidate] < best)
        some = corners[candidate[rows]]
        nearest, square = nearest_in(points[rows], some)
        distance = np.sqrt(square)
        closer = distance < best[rows]
        rows = rows[closer]
        best[rows], face[rows], shares[rows] = distance[closer], candidate[rows], nearest[closer]
    return face, shares
