"""Crops of a mesh: the square patch of it that a finger presses on at a place, as a height map."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from relief.ground.arrays import Array, Index, extents
from relief.ground.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.patches import samples_of
from relief.solids.body import Body
from relief.solids.meshes.mesh_places import Frame, vertex_normals
from relief.solids.meshes.neighbourhood import NearFaces
from relief.solids.meshes.raster import rasterise

SAMPLES = 128
"""Samples along 10 mm of a crop."""
EDGE_SHARE = 0.005
"""Share of a patch's samples without a surface in reach, above which the place counts as on an edge."""
FLAT_MM = 1e-3
"""Difference of heights, mm, below which a patch is a plane."""
RIM_MM, RIM_SHARE = 4.5, 0.03
"""Distance from the place, mm, beyond which this share of a plane's patch may lie below the plane."""
FINE_MM = 0.3
"""Longest edge, mm, of faces that sample a smooth surface; larger faces count as flat."""
STEEPEST = 20.0
"""Largest slope of a surface that is curved between its vertices."""


@dataclass(frozen=True)
class SurfaceCrop:
    """The surface under a finger at a contact location.

    Attributes:
        frame: of the place.
        heights: (n, n) mm along the axis, the lowest reach of the finger at 0, the highest point of the
            middle at 3 mm.
        on_edge: whether the middle reaches over an edge: there is no surface, or one more than 3 mm below the
            highest.
        side_mm: of the patch.
        level_mm: place along the axis at which heights are 0, counted from that of the frame.
    """

    frame: Frame
    heights: Array
    on_edge: bool
    side_mm: float = PATCH_SIDE_MM
    level_mm: float = 0.0

    @classmethod
    def of(cls, frame: Frame, heights: Array, side_mm: float) -> Self:
        """The crop of heights (n, n) mm, counted from a place; -inf: no surface."""
        above, on_edge, level = reachable(heights, side_mm)
        return cls(frame, above, on_edge, side_mm, level)

    @property
    def middle(self) -> Array:
        """Heights of the 10 mm around the place, mm."""
        return in_the_middle(self.heights, self.side_mm)

    @cached_property
    def flat(self) -> bool:
        """Whether the patch is a plane without texture; the rim of the plane may lie on the rim of the patch.

        The axis of a place beside a rim may lean a little, so the plane may, too, and what lies below the rim
        is seen. Lower than the plane may lie 3 % of the patch, all beyond 4.5 mm from the place.
        """
        if self.on_edge:
            return False
        heights = self.middle
        down, across = (np.median(np.diff(heights, axis=axis)) for axis in (0, 1))
        row, col = np.indices(heights.shape) - 0.5 * (len(heights) - 1.0)
        above = heights - down * row - across * col
        above -= np.median(above)
        beyond = np.hypot(row, col) * PATCH_SIDE_MM > RIM_MM * len(heights)
        uneven = np.where(beyond, above > FLAT_MM, np.abs(above) > FLAT_MM).any()
        return bool(not uneven and (above < -FLAT_MM).mean() < RIM_SHARE)


class Cropper:
    """Crops of one body.

    Faces with edges of at most 0.3 mm are taken as samples of a smooth surface, as `retouch export` writes
    them, and are curved between their vertices by the vertices' normals: flat between them, V of a plate of
    bricks came out half a just-noticeable difference larger than that of its samples.

    Args:
        body: The touched body.
        samples: Along 10 mm of a crop.
        fine_mm: Longest edge of the faces that are curved, mm; 0: all are flat.
        side_mm: Of a crop; None: 10 mm.
    """

    def __init__(
        self, body: Body, samples: int = SAMPLES, fine_mm: float = FINE_MM, side_mm: float | None = None
    ) -> None:
        self._body, self._faces = body, body.faces
        self._corners = body.vertices[body.faces]
        self._normals = body.normals
        edges = self._corners - np.roll(self._corners, 1, axis=1)
        self._fine = extents(np.einsum("fcd,fcd->fc", edges, edges))[1] <= fine_mm**2
        self._vertex_normals = vertex_normals(body)
        self._near = NearFaces(self._corners)
        self._side = side_mm or PATCH_SIDE_MM
        self._samples = samples if side_mm is None else samples_of(side_mm, PATCH_SIDE_MM / samples)

    def crop(self, frame: Frame) -> SurfaceCrop:
        """The patch around a place, seen along its axis.

        Back faces are culled; of several surfaces above one another the highest counts.
        """
        return SurfaceCrop.of(frame, self.heights(frame, self._side, self._samples), self._side)

    def heights(self, frame: Frame, side_mm: float, samples: int, depth_mm: float = HEIGHT_LIMIT_MM) -> Array:
        """Heights (samples, samples) mm of a square around a place, counted from the place; -inf: none.

        Faces farther from the place than a depth along the axis may be left out.
        """
        near = self._around(frame, 0.5 * side_mm, depth_mm)
        seen = near[self._normals[near] @ frame.axes[2] > 0.0]
        slopes = np.repeat(_slopes(self._normals[seen] @ frame.axes.T)[:, None], 3, axis=1)
        at_corners = self._vertex_normals[self._faces[seen]] @ frame.axes.T
        curved = _slopes(at_corners)
        smooth = self._fine[seen] & (extents(at_corners[:, :, 2])[0] > 0.0)
        smooth &= extents(np.abs(curved).reshape(-1, 6))[1] < STEEPEST
        slopes[smooth] = curved[smooth]
        return rasterise(frame.local(self._corners[seen]), slopes, side_mm, samples)

    def around(self, frame: Frame, reach_mm: float) -> Body:
        """The body in the axes of a place, mm: its faces within a reach along x and y, 6 mm down and up."""
        near = self._around(frame, reach_mm, 2.0 * HEIGHT_LIMIT_MM)
        vertices, faces = self._body.part(near)
        return within(Body(frame.local(vertices), faces), reach_mm)

    def _around(self, frame: Frame, reach_mm: float, depth_mm: float) -> Index:
        """Faces near the box that holds a turned patch and what lies below or above it."""
        half = np.abs(frame.axes).T @ (reach_mm, reach_mm, depth_mm)
        return self._near.within(frame.at - half, frame.at + half)


def within(body: Body, reach_mm: float) -> Body:
    """The faces of a body whose boxes come within a reach of the z axis along x and along y, mm."""
    x, y = body.vertices[:, 0], body.vertices[:, 1]
    beyond = (x >= reach_mm) | (x <= -reach_mm) << 1 | (y >= reach_mm) << 2 | (y <= -reach_mm) << 3
    a, b, c = body.faces.T
    return body.part((beyond[a] & beyond[b] & beyond[c]) == 0)


def _slopes(normals: Array) -> Array:
    """(..., 2) derivatives of the heights of planes by their normals (..., 3)."""
    up = normals[..., 2:]
    return -normals[..., :2] / np.where(up == 0.0, 1.0, up)


def in_the_middle(heights: Array, side_mm: float) -> Array:
    """Heights (m, m) of the 10 mm in the middle of a patch (n, n) of a side."""
    beside = (len(heights) - round(PATCH_SIDE_MM / side_mm * len(heights))) // 2
    return heights[beside : len(heights) - beside, beside : len(heights) - beside]


def reachable(heights: Array, side_mm: float) -> tuple[Array, bool, float]:
    """Heights (n, n) mm that a finger can reach, 0 to 3 mm in the middle, and whether that is on an edge.

    The last is the height that counts as 0 now, mm.
    """
    top = float(in_the_middle(heights, side_mm).max())
    if not np.isfinite(top):
        return np.zeros_like(heights), True, 0.0
    above = heights - (top - HEIGHT_LIMIT_MM)
    on_edge = (in_the_middle(above, side_mm) < 0.0).mean() > EDGE_SHARE
    return np.clip(above, 0.0, None), bool(on_edge), top - HEIGHT_LIMIT_MM
