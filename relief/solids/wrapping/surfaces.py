"""The surface to be wrapped: settings, triangles of about a millimetre, and the fine triangles."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, FloatArray, smooth_step, sums_by
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.mending.holes import Holes
from relief.solids.meshes.neighbourhood import edge_ends
from relief.solids.meshes.refining import Refined
from relief.solids.meshes.solid import check_apart
from relief.solids.meshes.unrolling import nearest_shares
from relief.solids.remeshing.coarsening import coarsened
from relief.solids.remeshing.even_mesh import ARC, EvenMesh, even_mesh, vertex_normals
from relief.solids.remeshing.smooth_surface import raised
from relief.solids.wrapping.coordinates.layout import Layout
from relief.solids.wrapping.masks import Points, Regions, mask_at
from relief.solids.wrapping.options import MOST_FACES, SurfaceOptions
from relief.solids.wrapping.texture_tiles import Tile

BASE_EDGE_MM = 1.0
"""Longest edge of the mesh that patches, normals and clearance are computed on, mm."""
DRAFT_EDGE_MM = 2.0
"""`BASE_EDGE_MM` of a draft, mm."""
DRAFT_ARC = 1.4
"""Largest angle of the arc of an edge of a draft, relative to that of a file. With 2 fillets
show facets in a preview; with 1 a bracelet takes half as long again."""
EVEN_AREA = 0.4
"""Mean area of even triangles, in the square of the edge wanted."""
LEAST_BASE_EDGES = 24
"""Edges at least along the longest side of a small object."""
ENOUGH_MM2 = 0.0035
"""Default mean area of the textured triangles, mm²: smaller ones change the feel of gravel, grass and leather
by less than 0.1 JND (docs/evidence/objects.md)."""
BOTTOM = 0.002
"""Height above the lowest point within which a triangle that points down is the bottom, mm."""
LEAST_BOTTOM_MM2 = 4.0
"""Least area of a flat bottom, mm²: the lowest triangles of a ball are none."""
CORRECTION_GAIN = 0.5
"""Gain of the correction of vertices, relative to the mean error of triangles at their middles. For flat
triangles with edges of 0.15 mm gravel feels right with 0.9, for a smooth surface through the vertices with
0.4."""
FACES_AT_ONCE = 1 << 18
"""Triangles whose middles are computed together, which bounds the memory."""
RIM_MM = 0.1
"""Distance of the sample points of the rim of the bottom, mm."""


@dataclass(frozen=True, kw_only=True)
class Settings(SurfaceOptions):
    """How a body is wrapped: the options, and what follows from mesh and printer.

    Attributes:
        draft: Whether the body is to be looked at and not to be printed: patches, normals and clearance are
            computed on triangles of `DRAFT_EDGE_MM`, and crossing triangles stay.
        holes: That stay without texture; None: no hole does.
        finest_mm: Edges that are fine enough whatever the texture has, as no printer shows more.
        crosses: Whether the body passes through itself somewhere, which is refused where texture would lie.
    """

    draft: bool = False
    holes: Holes | None = None
    finest_mm: float = 0.0
    crosses: bool = False


class BaseSurface:
    """The body with triangles of about a millimetre, its normals and masks.

    Attributes:
        body: The finer body.
        uv: (faces, 3, 2) texture coordinates, or None.
        bottom: (faces,) those of a flat bottom that stays.
        coarser: Edges of its triangles, relative to those for a file: 1, more in a draft.
        bed_mm: Height of the bottom, mm, the lowest of all heights; minus infinity without a bottom.
        normals: (vertices, 3) outward unit normals.
        carried: (vertices,) how much of any texture each vertex carries.
        points: The vertices, as masks take them.
        masked: Whether a mask leaves anything out.
        regions: Regions that masks may name.
    """

    def __init__(
        self,
        body: Body,
        uv: Array | None,
        regions: Regions,
        settings: Settings,
        colours: FloatArray | None = None,
    ) -> None:
        longest = float(np.ptp(body.vertices, axis=0).max())
        finest = min(BASE_EDGE_MM, longest / LEAST_BASE_EDGES)
        edge = min(DRAFT_EDGE_MM, longest / LEAST_BASE_EDGES) if settings.draft else finest
        self.coarser = edge / finest
        check_count(int(body.areas.sum() / (EVEN_AREA * edge**2)), settings)
        bottom = _bottom(body) if settings.keep_bottom else np.zeros(len(body.faces), bool)
        self.mesh = even_mesh(body, edge, uv, bottom, ARC * min(self.coarser, DRAFT_ARC))
        self.body, self.uv, self.bottom = self.mesh.body, self.mesh.uv, bottom[self.mesh.origin]
        self.bed_mm = float(body.vertices[:, 2].min()) if self.bottom.any() else -np.inf
        self._flatten()
        self.regions = regions
        self.normals = vertex_normals(self.mesh, self.bottom)
        painted = None if colours is None else _vertex_colours(self.mesh, body, colours)
        self.points = Points(self.body.vertices, self.normals, self._vertex_uv(), regions, painted)
        self.masked = settings.mask is not None
        self.carried = self.carried_at(self.points, self.body.faces[self.bottom], settings)
        self._coarsen(bottom, edge)
        if settings.crosses:
            check_apart(self.body, self.textured, "mesh")

    @property
    def textured(self) -> NDArray[np.bool_]:
        """(faces,) whether any texture lies there."""
        return np.asarray((self.carried > 0.0)[self.body.faces].any(axis=1))

    def _coarsen(self, bottom: NDArray[np.bool_], edge_mm: float) -> None:
        """Leave fewer triangles where no texture lies and the surface is flat.

        Args:
            bottom: (faces,) those of the object's own triangles that are its bottom.
            edge_mm: Edges of the even triangles, mm.
        """
        self.mesh, left = coarsened(self.mesh, self.textured, edge_mm)
        self.body, self.bottom = self.mesh.body, bottom[self.mesh.origin]
        self.normals, self.carried = self.normals[left], self.carried[left]
        self.points = self.points.at(left)

    def _flatten(self) -> None:
        """Bring the bottom into its plane: not a rounding error above or below the bed of a printer."""
        faces, on_bottom = self.body.faces, self._on_bottom
        self.body.vertices[on_bottom, 2] = self.bed_mm
        self.body.vertices[:, 2] = np.maximum(self.body.vertices[:, 2], self.bed_mm)
        level = self.bottom[:, None] | (on_bottom[faces] & on_bottom[np.roll(faces, -1, axis=1)])
        self.mesh.bulges[level, 2] = 0.0

    @property
    def _on_bottom(self) -> NDArray[np.bool_]:
        """(vertices,) those of the bottom."""
        on_bottom = np.zeros(len(self.body.vertices), bool)
        on_bottom[self.body.faces[self.bottom]] = True
        return on_bottom

    def carried_at(self, points: Points, bottom: NDArray[np.intp], settings: Settings) -> Array:
        """How much of any texture each point carries, 0 to 1.

        Args:
            points: Of the surface.
            bottom: (k,) or (k, 3) numbers of those on the bottom.
            settings: With the mask and the falloff.
        """
        carried = np.ones(len(points.places))
        if settings.mask is not None:
            carried = mask_at(settings.mask, points, settings.falloff_mm)
        if self.bottom.any():
            far, _ = cKDTree(self.rim()).query(points.places, distance_upper_bound=settings.falloff_mm)
            carried *= smooth_step(np.minimum(far, settings.falloff_mm) / settings.falloff_mm)
            carried[bottom] = 0.0
        if settings.holes is not None:
            carried *= settings.holes.share(points.places, settings.falloff_mm)
        return carried

    def _vertex_uv(self) -> Array | None:
        if self.uv is None:
            return None
        uv = np.zeros((len(self.body.vertices), 2))
        uv[self.body.faces] = self.uv
        return uv

    def rim(self) -> Array:
        """(n, 3) points on the rim of the bottom, mm, at most `RIM_MM` apart."""
        one, other = edge_ends(self.body.faces[~self.bottom])
        on_rim = self._on_bottom[one] & self._on_bottom[other]
        start, end = self.body.vertices[one[on_rim]], self.body.vertices[other[on_rim]]
        longest = max(BASE_EDGE_MM, float(np.linalg.norm(end - start, axis=1).max(initial=0.0)))
        share = np.linspace(0.0, 1.0, int(longest / RIM_MM) + 1)[:, None, None]
        return np.asarray((start + share * (end - start)).reshape(-1, 3))


class FineSurface:
    """The fine body by the numbers of the base: attributes at its vertices, and their coordinates."""

    def __init__(self, base: BaseSurface, fine: Refined, covered: NDArray[np.bool_]) -> None:
        self.base, self.parent, self.share = base, *fine.vertex_parents(covered)
        self._flat, self.fine = fine, self._raised(fine)
        normals = self.of_vertices(base.normals)
        normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        uv = None if base.uv is None else self.of_corners(base.uv[self.parent])
        colours = base.points.colours
        painted = None if colours is None else self.of_vertices(colours)
        self.points = Points(self.fine.body.vertices, normals, uv, base.regions, painted)

    def _raised(self, flat: Refined) -> Refined:
        """The fine triangles on the smooth surface, not below the bed."""
        places = flat.body.vertices + raised(self.base.mesh.bulges, self.parent, self.share)
        places[:, 2] = np.maximum(places[:, 2], self.base.bed_mm)
        return Refined(Body(places, flat.body.faces), flat.parent, flat.corners)

    def flatten(self, vertices: NDArray[np.bool_]) -> bool:
        """Bring the surface onto the base's triangles around vertices (n,); whether it was not there."""
        bulges, ends = self.base.mesh.bulges, vertices[self.base.body.faces]
        around = ends | np.roll(ends, -1, axis=1)
        bulged = bool(bulges[around].any())
        if bulged:
            bulges[around] = 0.0
            self.fine = self._raised(self._flat)
        return bulged

    def to_bed(self) -> Array:
        """Ways (fine vertices,) along the normals down to the plane of the bottom, mm; infinite upward."""
        down = -self.points.normals[:, 2]
        way = np.full(len(down), np.inf)
        return np.divide(self.points.places[:, 2] - self.base.bed_mm, down, out=way, where=down > 0.0)

    def of_vertices(self, values: Array) -> Array:
        """Values (fine vertices, ...) between those at the base's vertices."""
        return self.of_corners(values[self.base.body.faces[self.parent]])

    def of_corners(self, values: Array) -> Array:
        """Values (fine vertices, ...) between those at the corners of their base triangles (n, 3, ...)."""
        return np.asarray(np.einsum("nc,nc...->n...", self.share, values))

    def carried(self, settings: Settings) -> Array:
        """How much of any texture each fine vertex carries, 0 to 1."""
        bottom = self.fine.body.faces[self.base.bottom[self.fine.parent]]
        return self.base.carried_at(self.points, bottom, settings)

    def heights(self, tile: Tile, layout: Layout, chosen: NDArray[np.bool_]) -> Array:
        """Heights (fine vertices,) of a tile with which the triangles come near it, mm; 0 where not chosen.

        With the tile's own heights at the vertices, triangles would cut off tops and hollows. So every vertex
        is moved by `CORRECTION_GAIN` times the mean error, by area, of the triangles around at their middles:
        a step towards the least squares.
        """
        fine = self.fine
        heights = np.zeros(len(chosen))
        heights[chosen] = tile.blended(*layout.at(self.parent[chosen], self.share[chosen]))
        faces = np.flatnonzero(chosen[fine.body.faces].all(axis=1))
        area = Body(fine.body.vertices, fine.body.faces[faces]).areas
        missed = np.empty(len(faces))
        for start in range(0, len(faces), FACES_AT_ONCE):
            part = faces[start : start + FACES_AT_ONCE]
            middle = tile.blended(*layout.at(fine.parent[part], fine.corners[part].mean(axis=1)))
            missed[start : start + FACES_AT_ONCE] = middle - heights[fine.body.faces[part]].mean(axis=1)
        corners = fine.body.faces[faces].ravel()
        total, weight = (
            np.bincount(corners, np.repeat(values, 3), len(chosen)) for values in (area * missed, area)
        )
        heights += CORRECTION_GAIN * np.divide(total, weight, out=np.zeros(len(chosen)), where=weight > 0.0)
        return np.clip(heights, min(0.0, tile.heights.min()), tile.heights.max())


def _vertex_colours(mesh: EvenMesh, body: Body, colours: FloatArray) -> Array:
    """Colours (vertices, 3) of an even mesh, means over its triangles, of those (m, 3, 3) of the body."""
    faces, origin = mesh.body.faces, mesh.origin
    triangles = np.repeat(body.vertices[body.faces[origin]], 3, axis=0)
    share = nearest_shares(mesh.body.vertices[faces.ravel()], triangles)
    at_corners = np.einsum("nc,ncd->nd", share, np.repeat(colours[origin], 3, axis=0))
    count = np.bincount(faces.ravel(), minlength=len(mesh.body.vertices))
    return sums_by(faces, at_corners, len(count)) / np.maximum(count, 1)[:, None]


def check_count(count: int, settings: Settings) -> None:
    """Refuse more triangles than memory holds with ease."""
    most = max(10 * MOST_FACES, settings.faces or 0)
    if count > most:
        raise InputError(
            f"edges: about {count:,} triangles would be needed, more than {most:,}; "
            "take longer edges (--edge-mm), a smaller mask or a smaller object"
        )


def _bottom(body: Body) -> NDArray[np.bool_]:
    """(faces,) the lowest triangles that point down, if they have an area."""
    corners = body.vertices[body.faces]
    normal, areas = body.normals, body.areas
    lowest = (corners[:, :, 2] <= body.vertices[:, 2].min() + BOTTOM).all(axis=1)
    flat = lowest & (normal[:, 2] < -0.9999 * np.linalg.norm(normal, axis=1))
    return np.asarray(flat & (areas[flat].sum() >= LEAST_BOTTOM_MM2))
