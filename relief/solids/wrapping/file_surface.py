"""The surface of a file: how much of any texture its points carry, by mask, bottom, holes and hollows."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from relief.ground.arrays import Array, Flags, FloatArray, Index, units
from relief.solids.body import Body
from relief.solids.mending.holes import RIM_MM, Holes
from relief.solids.meshes.neighbourhood import edge_ends, edge_pairs, points_along
from relief.solids.meshes.openness import Openness
from relief.solids.meshes.refining import refined
from relief.solids.meshes.shells import sealed_hollows
from relief.solids.remeshing.creases import SHARPEST
from relief.solids.remeshing.smooth_surface import corner_angles
from relief.solids.wrapping.bare_places import Bare, PlaceError
from relief.solids.wrapping.masks import ANGLE, OUTSIDE, Points, Regions, mask_at
from relief.solids.wrapping.options import SurfaceOptions

BASE_EDGE_MM = 1.0
"""Longest edge of the mesh that patches, normals and clearance are computed on, mm."""
DRAFT_EDGE_MM = 2.0
"""`BASE_EDGE_MM` of a draft, mm, of a body of up to `DRAFT_MM2`."""
DRAFT_MM2 = 40_000.0
"""Area, mm², from which the edges of a draft grow with the body: that of 25,000 even triangles of 2 mm."""
LEAST_BASE_EDGES = 24
"""Edges at least along the longest side of a small object."""
MOST_SAMPLES = 2_000_000
"""Samples of a body, about, at which shares are looked up first; their distance grows with its area."""
LEAST_SHARE = 1e-6
"""Share of the relief above which a place is touched: of a relief of 1 mm, a nanometre."""
BOTTOM = 0.002
"""Height above the lowest point within which a triangle that points down is the bottom, mm."""
MOST_LEFT = 0.05
"""Largest share of the textured area that is left out where the surface cannot carry texture."""
LEAST_BOTTOM_MM2 = 4.0
"""Least area of a flat bottom, mm²: the lowest triangles of a ball are none."""

Near = Callable[[Points], Flags]
"""Which points (n,) a texture may reach that is placed once."""


@dataclass(frozen=True, kw_only=True)
class Settings(SurfaceOptions):
    """How a body is wrapped: the options, and what follows from mesh and printer.

    Attributes:
        draft: Whether the body is to be looked at and not to be printed: patches, normals and clearance are
            computed on triangles of `DRAFT_EDGE_MM`, and crossing triangles stay.
        holes: That stay without texture; None: no hole does.
        bare: Further places that stay without texture, as where parts touch.
        united: Whether the parts of the body are united already.
        finest_mm: Edges that are fine enough whatever the texture has, as no printer shows more.
    """

    draft: bool = False
    holes: Holes | None = None
    bare: tuple[Bare, ...] = ()
    united: bool = False
    finest_mm: float = 0.0


@dataclass(eq=False)
class FileSurface:
    """A body of a file, and the share of the textures at its points.

    Attributes:
        body: Its triangles, each vertex once.
        uv: (faces, 3, 2) texture coordinates of the corners, or None.
        regions: Regions that masks may name.
        settings: With mask, falloff, holes and how fine the base is.
        colours: (faces, 3, 3) of the corners, or None.
        exact: (faces, 3, 3) normals of the exact surface at the corners, not finite where unknown, or None.
        masks: Further masks of textures.
        edge_mm: Edges of the even triangles, mm.
        coarser: The same, relative to those for a file: 1, more in a draft.
        bottom: (faces,) those of a flat bottom that stays.
        bed_mm: Height of the bottom, mm, the lowest of all heights; minus infinity without a bottom.
        bare: (faces,) those that carry nothing: the bottom and sealed hollows.
        by_angle: Whether a mask needs the angles of round surfaces.
    """

    body: Body
    uv: Array | None
    regions: Regions
    settings: Settings
    colours: FloatArray | None = None
    exact: Array | None = None
    masks: Sequence[str | None] = ()

    def __post_init__(self) -> None:
        body, settings = self.body, self.settings
        texts = [mask for mask in (settings.mask, *self.masks) if mask is not None]
        self.by_angle = any(ANGLE in text or OUTSIDE in text for text in texts)
        longest = float(np.ptp(body.vertices, axis=0).max())
        finest = min(BASE_EDGE_MM, longest / LEAST_BASE_EDGES)
        draft = DRAFT_EDGE_MM * max(1.0, float(np.sqrt(body.areas.sum() / DRAFT_MM2)))
        self.edge_mm = min(draft, longest / LEAST_BASE_EDGES) if settings.draft else finest
        self.coarser = self.edge_mm / finest
        self.bottom = _bottom(body) if settings.keep_bottom else np.zeros(len(body.faces), bool)
        self.bed_mm = float(body.vertices[:, 2].min()) if self.bottom.any() else -np.inf
        self.bare = self.bottom | sealed_hollows(body)
        self._left_mm2 = 0.0
        rim = points_between(body, self.bottom, RIM_MM)
        self._places = [*settings.bare, *([Bare(rim)] if len(rim) else [])]

    @cached_property
    def _corner_normals(self) -> Array:
        """(faces, 3, 3) unit normals at the corners, means over triangles there that turn by little.

        The square of the area weights them, so that long triangles of a wall keep their angle beside narrow
        ones of a fillet. Exact normals are taken as they are.
        """
        body, count = self.body, self.body.faces.size
        normals = np.repeat(units(body.normals), 3, axis=0)
        at = sp.csr_array((np.ones(count, np.int8), (np.arange(count), body.faces.ravel())))
        one, other = (at @ at.T).nonzero()
        near = np.einsum("nd,nd->n", normals[one], normals[other]) > np.cos(SHARPEST)
        weight = (corner_angles(body) * body.areas[:, None] ** 2).ravel()
        weights = sp.csr_array((weight[other[near]], (one[near], other[near])))
        means = units(weights @ normals).reshape(-1, 3, 3)
        return means if self.exact is None else np.where(np.isfinite(self.exact), self.exact, means)

    def normals_at(self, face: Index, share: Array) -> Array:
        """Unit normals (n, 3) by which masks compare angles, at barycentric coordinates in triangles."""
        if self.by_angle:
            return units(np.einsum("nc,ncd->nd", share, self._corner_normals[face]))
        return units(self.body.normals)[face]

    def points(self, face: Index, share: Array) -> Points:
        """Points at barycentric coordinates (n, 3) in triangles (n,)."""
        uv, colours = (
            None if of is None else np.einsum("nc,ncd->nd", share, of[face]) for of in (self.uv, self.colours)
        )
        places = np.einsum("nc,ncd->nd", share, self.body.vertices[self.body.faces[face]])
        return self.as_points(places, self.normals_at(face, share), uv, colours)

    @cached_property
    def _openness(self) -> Openness:
        return Openness(self.body)

    def as_points(self, places: Array, normals: Array, uv: Array | None, colours: Array | None) -> Points:
        """Points with the regions and the box of the body."""
        low, high = self.body.vertices.min(axis=0), self.body.vertices.max(axis=0)
        openness = lambda at, normals: self._openness.at(at, normals)  # noqa: E731
        return Points(places, normals, uv, self.regions, colours, (low + high) / 2.0, openness)

    def share_at(self, points: Points) -> Array:
        """How much of any texture points carry, (n,) from 0 to 1, if they are on no bare triangle."""
        settings, far = self.settings, self.settings.falloff_mm
        share = np.ones(len(points.places))
        if settings.mask is not None:
            share = mask_at(settings.mask, points, far)
        for place in self._places:
            share *= place.share(points.places, far)
        if settings.holes is not None:
            share *= settings.holes.share(points.places, far)
        return share

    @cached_property
    def samples(self) -> "Samples":
        """The surface at points all over the triangles that may carry texture."""
        return Samples(self)

    def leave(self, error: PlaceError) -> str:
        """Leave the place of an error without texture; a line about it. Raises it if the place is large."""
        place, samples = Bare(error.points, self.edge_mm), self.samples
        before = float((samples.areas * samples.share).sum())
        samples.share *= place.share(samples.points.places, self.settings.falloff_mm)
        taken_mm2 = before - float((samples.areas * samples.share).sum())
        self._left_mm2 += taken_mm2
        if self._left_mm2 > MOST_LEFT * (before - taken_mm2):
            raise error
        self._places.append(place)
        return f"leaves {taken_mm2:.0f} mm² without texture, as {error.fault}"


class Samples:
    """Corners of small triangles all over a file's surface, those of bare triangles left out.

    Attributes:
        spacing_mm: Longest distance of neighbours, mm.
        face: (n,) triangle of the file.
        points: (n,) the points.
        areas: (n,) area around each, mm².
        share: (n,) how much of any texture each carries.
    """

    def __init__(self, surface: FileSurface) -> None:
        rows, body = np.flatnonzero(~surface.bare), surface.body
        alone = Body(body.vertices[body.faces[rows]].reshape(-1, 3), np.arange(3 * len(rows)).reshape(-1, 3))
        corners = alone.vertices[alone.faces]
        longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
        # Needles are divided along their lengths.
        self.spacing_mm = max(
            surface.edge_mm,
            float(np.sqrt(alone.areas.sum() / MOST_SAMPLES)),
            float(longest[longest > surface.edge_mm].sum()) / MOST_SAMPLES,
        )
        fine = refined(alone, self.spacing_mm)
        self.face = rows[np.repeat(fine.parent, 3)]
        self.points = surface.points(self.face, fine.corners.reshape(-1, 3).astype(np.float64))
        self.areas = np.repeat(fine.body.areas / 3.0, 3)
        self.share = surface.share_at(self.points)


def _bottom(body: Body) -> Flags:
    """(faces,) the lowest triangles that point down, if they have an area."""
    corners = body.vertices[body.faces]
    normal, areas = body.normals, body.areas
    lowest = (corners[:, :, 2] <= body.vertices[:, 2].min() + BOTTOM).all(axis=1)
    flat = lowest & (normal[:, 2] < -0.9999 * np.linalg.norm(normal, axis=1))
    return np.asarray(flat & (areas[flat].sum() >= LEAST_BOTTOM_MM2))


def points_between(body: Body, chosen: Flags, spacing_mm: float) -> Array:
    """(n, 3) points at most so far apart on the edges between chosen triangles, (faces,), and others, mm."""
    pairs = edge_pairs(body.faces)
    half = pairs[chosen[pairs[:, 0] // 3] != chosen[pairs[:, 1] // 3], 0]
    return points_along(body.vertices[np.stack(edge_ends(body.faces), axis=1)[half]], spacing_mm)
