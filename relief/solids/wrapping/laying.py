"""Placement of textures on a body in flat coordinates, repeated or once."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Flags, flagged, quantiles, smooth_step
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import ways_from
from relief.solids.meshes.unrolling import feet
from relief.solids.wrapping.coordinates.closing import change_line, closed
from relief.solids.wrapping.coordinates.found import OFF_SIZE, Coordinates, found_coordinates, shown_vector
from relief.solids.wrapping.coordinates.geodesic_patches import lay_once, room_around
from relief.solids.wrapping.coordinates.layout import Layout, one_patch, stretches
from relief.solids.wrapping.file_surface import LEAST_SHARE, FileSurface, Near
from relief.solids.wrapping.masks import Points, mask_at
from relief.solids.wrapping.placement import Placement, turned
from relief.solids.wrapping.surfaces import BaseSurface, FineSurface
from relief.solids.wrapping.texture_tiles import Covering

BLEND_MM = 2.0
"""Width of the strip on which neighbouring patches share the surface, mm."""
OFF_MM = 1.0
"""Distance, mm, of a stated point from the surface from which it is told."""
TOP_MM = 0.5
"""Depth of what counts as the top of a body, mm."""


@dataclass(frozen=True)
class Laid:
    """A texture with its coordinates on a body.

    Attributes:
        covering: The texture and its mask.
        layout: Its coordinates.
        fade: (vertices,) share of the texture, which falls to 0 at the border of its chart; None: 1.
    """

    covering: Covering
    layout: Layout
    fade: Array | None = None

    def on_base(self, base: BaseSurface, falloff_mm: float) -> Array:
        """Share (vertices,) of the texture on the coarse triangles, 0 to 1."""
        share = np.ones(len(base.body.vertices))
        if self.covering.mask is not None:
            share = mask_at(self.covering.mask, base.points, falloff_mm)
        if self.covering.once:
            inside = self.covering.tile.window(self.layout.uv, falloff_mm) * (self.layout.weight > 0.0)
            window = np.zeros(len(share))
            np.maximum.at(window, base.body.faces, inside.max(axis=1))
            share = share * window * (1.0 if self.fade is None else self.fade)
        return np.asarray(share)

    def on_fine(self, surface: FineSurface, falloff_mm: float) -> Array:
        """Share (fine vertices,) of the texture, 0 to 1."""
        uv, weight = self.layout.at(surface.parent, surface.share)
        share = weight.any(axis=1).astype(float)
        if self.covering.mask is not None:
            share *= mask_at(self.covering.mask, surface.points, falloff_mm)
        if self.covering.once:
            share *= (self.covering.tile.window(uv, falloff_mm) * weight).sum(axis=1)
            if self.fade is not None:
                share *= surface.of_vertices(self.fade)
        return np.asarray(share)

    def moved(self, old: BaseSurface, new: BaseSurface) -> "Laid":
        """The texture in its place, by one chart of an old base, on a new one."""
        faces = np.flatnonzero(self.layout.laid())
        face, share = feet(new.body.vertices, Body(old.body.vertices, old.body.faces[faces]))
        number = faces[face]
        uv = np.einsum("nc,ncd->nd", share, self.layout.uv[number, 0])[new.body.faces]
        fade = None
        if self.fade is not None:
            fade = (share * self.fade[old.body.faces[number]]).sum(axis=1)
        stretch = stretches(new.body.vertices[new.body.faces], uv)
        return Laid(self.covering, one_patch(np.ones(len(uv), bool), uv, stretch), fade)


class TexturePlacer:
    """Lays textures on a body, each repeated or once.

    Attributes:
        notes: Lines about how textures were placed, and what was changed so that they fit.
    """

    def __init__(self, base: BaseSurface, placement: Placement, falloff_mm: float) -> None:
        self.base, self.placement, self.falloff_mm = base, placement, falloff_mm
        self.notes: list[str] = []
        self._all: Coordinates | None = None

    def laid(self, coverings: Sequence[Covering]) -> list[Laid]:
        """The textures in their places. Raises InputError if the projection does not go with the body."""
        return [self._once(each) if each.once else self._repeated(each) for each in coverings]

    @property
    def coordinates(self) -> str:
        """Name of the coordinates that were taken."""
        return "patches" if self._all is None else self._all.name

    def _repeated(self, covering: Covering) -> Laid:
        coordinates = self._coordinates(covering)
        layout, placement = coordinates.layout, self.placement
        matrices = turned(placement.turn_deg)[None]
        if layout.around_mm is not None:
            rows, cols = covering.tile.size_mm
            closings = [closed(around, placement.turn_deg, cols, rows) for around in layout.around_mm]
            matrices = np.stack([closing.matrix for closing in closings])
            for closing, part in zip(closings, coordinates.parts, strict=True):
                self._note(change_line(closing, (rows, cols), placement.turn_deg, part))
        # The offset is in the axes of the surface.
        uv = layout.uv - np.array(placement.offset_mm)
        corners = self.base.body.vertices[self.base.body.faces]
        return Laid(covering, replace(layout, uv=uv).moved(corners, matrices, np.zeros(2)))

    def _note(self, line: str) -> None:
        self.notes += [line] if line and line not in self.notes else []

    def _coordinates(self, covering: Covering) -> Coordinates:
        """The coordinates that all textures share; found for the first of them."""
        if self._all is None:
            tile = None if covering.once else covering.tile
            self._all = found_coordinates(self.base, self.placement, tile, BLEND_MM)
            self._note(self._all.line)
        return self._all

    def _once(self, covering: Covering) -> Laid:
        """A texture around its place."""
        base, placement = self.base, self.placement
        rows, cols = covering.tile.size_mm
        corners = base.body.vertices[base.body.faces]
        middle, share = self._place(covering)
        at = share @ corners[middle]
        stated = self.placement.at
        away = 0.0 if stated is None else float(np.linalg.norm(at - np.array(stated)))
        beside_it = f", {away:.1f} mm from the point that is stated" if away > OFF_MM else ""
        self._note(f"placed once, around ({shown_vector(at)}) mm{beside_it}")
        fade: Array | None = None
        if placement.projection in ("auto", "patches"):
            half = 0.5 * math.hypot(rows, cols) + math.hypot(*placement.offset_mm)
            seed = int(base.body.faces[middle, np.argmax(share)])
            layout = lay_once(base.body, base.normals, seed, half, placement.direction)
        else:
            layout, fade = self._one_chart(covering, middle)
        uv = layout.uv - share @ layout.uv[middle, 0] - np.array(placement.offset_mm)
        shift = np.array([0.5 * cols, -0.5 * rows])
        return Laid(
            covering, replace(layout, uv=uv).moved(corners, turned(placement.turn_deg)[None], shift), fade
        )

    def _one_chart(self, covering: Covering, middle: int) -> tuple[Layout, Array]:
        """The chart that a triangle lies in, cut on the other side, and how it ends at its border."""
        layout, body = self._coordinates(covering).layout, self.base.body
        leading = layout.leading()
        chart = int(leading[middle])
        own = layout.laid() & (leading == chart)
        others = flagged(body.faces[~own & layout.laid()], len(body.vertices))
        ways = ways_from(body, others, self.falloff_mm)
        fade = smooth_step(np.minimum(ways, self.falloff_mm) / self.falloff_mm)
        uv = layout.uv[:, chart] - layout.uv[middle, chart, 0]
        if layout.around_mm is not None and np.isfinite(around := float(layout.around_mm[chart])):
            uv[..., 0] -= around * np.round(uv[..., 0].mean(axis=1, keepdims=True) / around)
        return one_patch(own, uv, layout.stretch), fade

    def _place(self, covering: Covering) -> tuple[int, Array]:
        """The triangle that a texture is placed around once, and where in it, by three shares."""
        base = self.base
        middle = middle_of(base.file, self.placement, covering.mask)
        carrying = np.flatnonzero(base.textured)
        face, share = feet(middle[None], Body(base.body.vertices, base.body.faces[carrying]))
        return int(carrying[face[0]]), share[0]


def middle_of(file: FileSurface, placement: Placement, mask: str | None) -> Array:
    """The point (3,) around which a texture with a mask is placed once, mm, near the surface.

    Raises InputError if the masks leave nothing.
    """
    if placement.at is not None:
        return np.array(placement.at)
    samples = file.samples
    carried, places = samples.share, samples.points.places
    if mask is not None:
        carried = carried * mask_at(mask, samples.points, file.settings.falloff_mm)
    if not (carried > LEAST_SHARE).any():
        raise InputError("mask: leaves nothing of the surface to the texture; take a wider mask")
    if file.settings.mask is None and mask is None:
        top = places[carried > LEAST_SHARE, 2].max() - TOP_MM
        carried = np.where(places[:, 2] >= top, carried, 0.0)
    return np.asarray(np.average(places, axis=0, weights=samples.areas * carried))


def reach_of(file: FileSurface, coverings: Sequence[Covering], placement: Placement) -> Near | None:
    """Where textures may lie of which each is placed once; None: everywhere."""
    if not all(covering.once for covering in coverings):
        return None
    middles = [middle_of(file, placement, covering.mask) for covering in coverings]
    shift, samples = math.hypot(*placement.offset_mm), file.samples
    reaches = [room_around(0.5 * math.hypot(*covering.tile.size_mm) + shift) for covering in coverings]
    carrying = samples.points.places[samples.share > LEAST_SHARE]
    # The middle may lie off the surface, and the texture around the place next to it.
    places = [carrying[np.argmin(((carrying - middle) ** 2).sum(axis=1))] for middle in middles]

    def near(points: Points) -> Flags:
        far = np.stack([np.linalg.norm(points.places - place, axis=1) for place in places])
        return np.asarray((far < np.array(reaches)[:, None]).any(axis=0))

    return near


def beside(base: BaseSurface) -> Near:
    """Whether points are next to places of the base that carry a texture, and on the same side of a wall."""
    carrying = base.carried > 0.0
    tree, normals = cKDTree(base.body.vertices[carrying]), base.normals[carrying]

    def near(points: Points) -> Flags:
        far, place = tree.query(points.places, distance_upper_bound=1.5 * base.file.edge_mm)
        there = np.isfinite(far)
        there[there] = (points.normals[there] * normals[place[there]]).sum(axis=1) > 0.0
        return np.asarray(there)

    return near


def off_size(laid: Laid, body_areas: Array, where: Flags) -> tuple[float, float]:
    """Part of the textured area on which lengths are off by `OFF_SIZE`, and the most on 99 % of it."""
    where = where & laid.layout.laid()
    areas, stretch = body_areas[where], laid.layout.stretch[where]
    if not len(areas):
        return 0.0, 0.0
    return float(areas[stretch > OFF_SIZE].sum() / areas.sum()), float(quantiles(stretch, areas, 0.99))
