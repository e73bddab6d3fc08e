"""The surface that carries texture: triangles of about a millimetre, and the fine triangles."""

from dataclasses import replace
from functools import cached_property

import numpy as np

from relief.ground.arrays import AnyArray, Array, Flags, FloatArray, flagged, sums_by, units
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.intersections import crossing_faces
from relief.solids.meshes.refining import Refined
from relief.solids.meshes.shells import crossing_place
from relief.solids.meshes.solid import overlap_advice
from relief.solids.remeshing.even_mesh import ARC, ROUNDS, even_mesh, vertex_normals
from relief.solids.remeshing.facet_noise import smoothed, turns_by_chance
from relief.solids.remeshing.smooth_surface import raised
from relief.solids.wrapping.bare_places import PlaceError, points_on
from relief.solids.wrapping.coordinates.layout import Layout
from relief.solids.wrapping.file_surface import FileSurface, Near, Settings
from relief.solids.wrapping.options import MOST_FACES
from relief.solids.wrapping.parting import Rest, parted
from relief.solids.wrapping.texture_tiles import Tile

DRAFT_ARC = 1.4
"""Largest angle of the arc of an edge of a draft, relative to that of a file. With 2 fillets
show facets in a preview; with 1 a bracelet takes half as long again."""
DRAFT_ROUNDS = 2
"""Rounds of remeshing of a draft: its triangles are less even."""
EVEN_AREA = 0.4
"""Mean area of even triangles, in the square of the edge wanted."""
ENOUGH_MM2 = 0.0035
"""Default mean area of the textured triangles, mm²: smaller ones change the feel of gravel, grass and leather
by less than 0.1 JND (docs/evidence/objects.md)."""
CORRECTION_GAIN = 0.5
"""Gain of the correction of vertices, relative to the mean error of triangles at their middles. For flat
triangles with edges of 0.15 mm gravel feels right with 0.9, for a smooth surface through the vertices with
0.4."""
FACES_AT_ONCE = 1 << 18
"""Triangles whose middles are computed together, which bounds the memory."""


class BaseSurface:
    """The part of a file's surface that carries texture, with triangles of about a millimetre.

    Attributes:
        file: The surface of the file.
        rest: What carries none and stays as it is.
        mesh: The triangles, and the smooth surface.
        body: The triangles.
        uv: (faces, 3, 2) texture coordinates, or None.
        normals: (vertices, 3) outward unit normals.
        points: The vertices, as masks take them.
        carried: (vertices,) how much of any texture each vertex carries; 0 on the border.
        smooth: The smooth surface behind the file's facets there.
        touched: (file's faces,) triangles of the file that carry texture somewhere.
        facets: (k,) numbers of the file's triangles that `mesh` counts as its facets.
    """

    def __init__(self, file: FileSurface, near: Near | None = None) -> None:
        settings = file.settings
        with stage("normals"):
            parting = parted(file, near)
        self.file, self.rest, self.touched = file, parting.rest, parting.touched
        self.facets = parting.facets
        patch, self.smooth = parting.patch, parting.patch.surface
        if not settings.draft:
            whole = self.rest.joined(patch.body)
            crossing = crossing_faces(whole, of=np.arange(len(whole.faces)) < len(patch.body.faces))
            if len(crossing):
                place = crossing_place(whole, flagged(crossing, len(whole.faces)))
                at = ", ".join(f"{value:.4g}" for value in place)
                fault = f"{len(crossing)} faces with texture pass through others, some near ({at}) mm"
                advice = overlap_advice(whole, settings.united)
                raise PlaceError("mesh", fault, advice, points_on(whole, crossing))
        check_count(int(patch.body.areas.sum() / (EVEN_AREA * file.edge_mm**2)), settings)
        rounds = DRAFT_ROUNDS if settings.draft else ROUNDS
        self.mesh = even_mesh(patch, file.edge_mm, ARC * min(file.coarser, DRAFT_ARC), rounds)
        self.body, self.normals = self.mesh.body, vertex_normals(self.mesh)
        self.uv = None if file.uv is None else self._at_corners(file.uv[parting.facets])
        painted = None if file.colours is None else self._at_corners(file.colours[parting.facets])
        uv, colours = (None if of is None else self._at_vertices(of) for of in (self.uv, painted))
        self.points = file.as_points(self.body.vertices, self._mask_normals(), uv, colours)
        self.carried = file.share_at(self.points) * self.inner

    @property
    def textured(self) -> Flags:
        """(faces,) whether any texture lies there."""
        return np.asarray((self.carried > 0.0)[self.body.faces].any(axis=1))

    @cached_property
    def inner(self) -> Array:
        """(vertices,) 0 on the border and 1 elsewhere."""
        return (np.arange(len(self.body.vertices)) >= self.rest.border).astype(np.float64)

    def _mask_normals(self) -> Array:
        """(vertices, 3) unit normals by which masks compare angles: those of the file, as in `parted`."""
        if not self.file.by_angle:
            return self.normals
        facet, share = self.facets[self.mesh.facet.ravel()], self.mesh.share.reshape(-1, 3)
        normals = self.file.normals_at(facet, share).reshape(-1, 3, 3)
        if turns_by_chance(self.body, normals):
            normals = smoothed(self.body, normals)
        return vertex_normals(replace(self.mesh, normals=normals))

    def _at_corners(self, values: FloatArray) -> Array:
        """Values (faces, 3, k) at the corners, of those at the corners of the facets (m, 3, k)."""
        return np.asarray(np.einsum("fkc,fkcd->fkd", self.mesh.share, values[self.mesh.facet]))

    def _at_vertices(self, values: Array) -> Array:
        """Values (vertices, k), means of those at the corners (faces, 3, k)."""
        faces, count = self.body.faces, len(self.body.vertices)
        sums = sums_by(faces, values.reshape(-1, values.shape[2]), count)
        return sums / np.bincount(faces.ravel(), minlength=count)[:, None]


class FineSurface:
    """The fine patch by the numbers of the base: attributes at its vertices, and their coordinates.

    Attributes:
        rest: What carries no texture, with the border of the fine patch.
        normals: (vertices, 3) outward unit normals; those of `points` are for masks.
    """

    def __init__(self, base: BaseSurface, fine: Refined, rest: Rest, covered: Flags) -> None:
        self.base, self.rest, self.parent, self.share = base, rest, *fine.vertex_parents(covered)
        self._flat, self.fine = fine, self._raised(fine)
        self.normals, normals = (units(self.of_vertices(of)) for of in (base.normals, base.points.normals))
        uv = None if base.uv is None else self.of_corners(base.uv[self.parent])
        colours = base.points.colours
        painted = None if colours is None else self.of_vertices(colours)
        self.points = base.file.as_points(self.fine.body.vertices, normals, uv, painted)

    def _raised(self, flat: Refined) -> Refined:
        """The fine triangles on the smooth surface, not below the bed."""
        places = flat.body.vertices + raised(self.base.mesh.bulges, self.parent, self.share)
        places[:, 2] = np.maximum(places[:, 2], self.base.file.bed_mm)
        return Refined(Body(places, flat.body.faces), flat.parent, flat.corners)

    def flatten(self, vertices: Flags) -> bool:
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
        down = -self.normals[:, 2]
        way = np.full(len(down), np.inf)
        return np.divide(self.points.places[:, 2] - self.base.file.bed_mm, down, out=way, where=down > 0.0)

    def of_vertices(self, values: Array) -> Array:
        """Values (fine vertices, ...) between those at the base's vertices."""
        return self.of_corners(values[self.base.body.faces[self.parent]])

    def of_corners(self, values: Array) -> Array:
        """Values (fine vertices, ...) between those at the corners of their base triangles (n, 3, ...)."""
        return np.asarray(np.einsum("nc,nc...->n...", self.share, values))

    def carried(self) -> Array:
        """How much of any texture each fine vertex carries, 0 to 1."""
        return self.base.file.share_at(self.points) * self.of_vertices(self.base.inner)

    def padded(self, values: AnyArray, rest: float = 0.0) -> AnyArray:
        """Values (fine vertices,), and one value at all vertices of the rest."""
        return np.concatenate([values, np.full(len(self.rest.vertices), rest, values.dtype)])

    def heights(self, tile: Tile, layout: Layout, chosen: Flags) -> Array:
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


def check_count(count: int, settings: Settings) -> None:
    """Refuse more triangles than memory holds with ease."""
    most = max(10 * MOST_FACES, settings.faces or 0)
    if count > most:
        raise InputError(
            f"edges: about {count:,} triangles would be needed, more than {most:,}; "
            "take longer edges (--edge-mm), a smaller mask or a smaller object"
        )
