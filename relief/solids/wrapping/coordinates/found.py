"""Flat coordinates that fit a body: those of its mesh, of a cylinder, a sphere or a plane, or patches."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.wrapping.coordinates.charts import (
    Chart,
    by_charts,
    cylinder_charts,
    plane_charts,
    sphere_charts,
)
from relief.solids.wrapping.coordinates.closing import closed
from relief.solids.wrapping.coordinates.layout import Layout
from relief.solids.wrapping.coordinates.patches import lay_out
from relief.solids.wrapping.coordinates.revolution import Axis, axis_along, found_axis, found_centre
from relief.solids.wrapping.coordinates.texture_coordinates import by_texture_coordinates
from relief.solids.wrapping.placement import Placement
from relief.solids.wrapping.surfaces import BaseSurface
from relief.solids.wrapping.tiles import Tile

OFF_SIZE = 0.1
"""Change of a length, as a part of it, from which on it is told, and no cylinder is taken by itself."""
FITTING = 0.95
"""Part of the area that has to fit a cylinder for it to be taken by itself."""
LEAST_SIDE = 0.25
"""Part of the area that the side and the bore of such a cylinder have at least: a thin plate is none."""
MOST_CLOSING = 0.2
"""Change of the period, as a part of it, up to which a cylinder is taken by itself."""
ROUND = 0.17
"""Largest cosine between a normal and the direction around an axis on a surface of revolution: 10 degrees."""
OUTWARD = 0.93
"""Cosine between a normal and a direction from which on no patch follows it: 20 degrees."""
SAME_AXIS = 0.985
"""Cosine from which on a direction is that of an axis that was found: 10 degrees."""


class Coordinates(NamedTuple):
    """Flat coordinates of a body.

    Attributes:
        name: "texture coordinates", "cylinder", "sphere", "plane" or "patches".
        layout: In mm.
        parts: Names of the patches, where they have any.
        line: About the axis, the centre or the plane; empty where there is none.
    """

    name: str
    layout: Layout
    parts: tuple[str, ...] = ()
    line: str = ""


def found_coordinates(
    base: BaseSurface, placement: Placement, tile: Tile | None, blend_mm: float
) -> Coordinates:
    """The coordinates that a placement states, or those that fit a body best.

    Args:
        base: The body.
        placement: With the projection and the direction.
        tile: Which is to close around the body; None: none is.
        blend_mm: Width of the strip on which neighbouring patches share the surface.

    Raises:
        InputError: The projection does not go with the body.
    """
    return next(found for found in _Finder(base, placement, tile, blend_mm).candidates() if found is not None)


class _Finder:
    def __init__(self, base: BaseSurface, placement: Placement, tile: Tile | None, blend_mm: float) -> None:
        self.base, self.placement, self.tile, self.blend_mm = base, placement, tile, blend_mm
        self._normals = base.body.normals / np.maximum(2.0 * base.body.areas, 1e-12)[:, None]

    def candidates(self) -> Iterator[Coordinates | None]:
        """Coordinates in the order in which they are tried; the last ones fit every body."""
        kind, placement, base = self.placement.projection, self.placement, self.base
        if kind == "uv" or (kind == "auto" and placement.along is None):
            layout = by_texture_coordinates(base.body, base.uv, base.textured, any_size=kind == "uv")
            if kind == "uv" and layout is None:
                raise InputError("projection: uv: the mesh has no texture coordinates")
            yield None if layout is None else Coordinates("texture coordinates", layout)
        if kind in ("auto", "cylinder"):
            yield self._cylinder()
        if kind == "sphere":
            yield self._sphere()
        if kind == "plane":
            yield self._plane()
        self._check_direction()
        with stage("flat coordinates", 1.0, at_most=True):
            around = np.zeros(len(base.body.vertices), bool)
            around[base.body.faces[base.textured]] = True
            yield Coordinates(
                "patches", lay_out(base.body, around, self.blend_mm, base.normals, placement.direction)
            )

    def _check_direction(self) -> None:
        """Refuse a direction that lies nowhere in the surface, where it would have no effect."""
        along, where = self.placement.direction, self.base.textured
        if along is not None and (np.abs(self._normals[where] @ along) > OUTWARD).all():
            fault = f"along: {shown_vector(along)} points out of the surface everywhere"
            raise InputError(f"{fault}; take a direction that lies in it")

    def _cylinder(self) -> Coordinates | None:
        base, stated, where = self.base, self.placement.projection == "cylinder", self.base.textured
        middles, areas = base.body.vertices[base.body.faces[where]].mean(axis=1), base.body.areas[where]
        along = self.placement.direction
        axis = found_axis(middles, self._normals[where], areas, along if stated else None)
        if along is not None and axis.frame[2] @ along < 0.0:
            axis = axis_along(axis.point, -axis.frame[2])
        charts = cylinder_charts(base.body, self._normals, axis, where)
        layout = by_charts(base.body, charts, where, self.blend_mm)
        if not stated and not self._is_cylinder(axis, charts, layout):
            return None
        line = (
            f"cylinder about the axis ({shown_vector(axis.frame[2])}) through ({shown_vector(axis.point)}) mm"
        )
        return Coordinates("cylinder", layout, tuple(chart.name for chart in charts), line)

    def _is_cylinder(
        self,
        axis: Axis,
        charts: list[Chart],
        layout: Layout,
    ) -> bool:
        """Whether a body is a cylinder without being called one."""
        where, areas, along = self.base.textured, self.base.body.areas, self.placement.direction
        if along is not None and abs(along @ axis.frame[2]) < SAME_AXIS:
            return False
        side = np.any([chart.faces for chart in charts if np.isfinite(chart.around_mm)], axis=0) & where
        area, sides = areas[where].sum(), areas[side].sum()
        if sides < LEAST_SIDE * area:
            return False
        local = axis.local(self.base.body.vertices[self.base.body.faces[side]].mean(axis=1))
        around = np.cross(axis.frame[2], local @ axis.frame)
        off = np.abs((self._normals[side] * around).sum(axis=1)) > ROUND * np.linalg.norm(around, axis=1)
        if areas[side][off].sum() > (1.0 - FITTING) * sides:
            return False
        if areas[where & (layout.stretch > OFF_SIZE)].sum() > (1.0 - FITTING) * area:
            return False
        if self.tile is None:
            return True
        rows, cols = self.tile.size_mm
        closings = [
            closed(chart.around_mm, self.placement.turn_deg, cols, rows)
            for chart in charts
            if np.isfinite(chart.around_mm) and areas[chart.faces & where].sum() > (1.0 - FITTING) * area
        ]
        return all(abs(closing.scale - 1.0) <= MOST_CLOSING for closing in closings)

    def _sphere(self) -> Coordinates:
        base, where = self.base, self.base.textured
        middles = base.body.vertices[base.body.faces[where]].mean(axis=1)
        centre = found_centre(middles, self._normals[where], base.body.areas[where])
        along = self.placement.direction
        axis = axis_along(centre, np.array([0.0, 0.0, 1.0]) if along is None else along)
        charts = sphere_charts(base.body, axis, where)
        line = f"sphere about ({shown_vector(centre)}) mm"
        layout = by_charts(base.body, charts, where, self.blend_mm)
        return Coordinates("sphere", layout, tuple(chart.name for chart in charts), line)

    def _plane(self) -> Coordinates:
        base = self.base
        charts, facing = plane_charts(base.body, self._normals, base.textured, self.placement.direction)
        layout = by_charts(base.body, charts, base.textured, self.blend_mm)
        names = tuple(chart.name for chart in charts)
        return Coordinates("plane", layout, names, f"plane that faces ({shown_vector(facing)})")


def shown_vector(vector: Array) -> str:
    """A vector for a person, to hundredths."""
    return ", ".join(f"{value:.4g}" for value in np.round(vector, 2) + 0.0)
