"""Flat coordinates that fit a body: those of its mesh, where they keep sizes, of a cylinder, a
sphere or a plane, or patches.

`relief.solids.names.PROJECTIONS` names the function of each projection.
"""

from dataclasses import dataclass
from functools import cached_property
from pkgutil import resolve_name
from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array, Flags, flagged, units
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.names import PROJECTIONS
from relief.solids.wrapping.coordinates.charts import (
    Chart,
    by_charts,
    cylinder_charts,
    plane_charts,
    sphere_charts,
)
from relief.solids.wrapping.coordinates.closing import closed
from relief.solids.wrapping.coordinates.geodesic_patches import lay_out
from relief.solids.wrapping.coordinates.layout import Layout, one_patch, singular_values
from relief.solids.wrapping.coordinates.revolution import RevolutionAxis, axis_along, found_axis, found_centre
from relief.solids.wrapping.file_surface import DRAFT_EDGE_MM
from relief.solids.wrapping.placement import Placement
from relief.solids.wrapping.surfaces import BaseSurface
from relief.solids.wrapping.texture_tiles import Tile

OFF_SIZE = 0.1
"""Relative change of a length that is reported as distortion; a cylinder is not chosen automatically where
more than 5 % of the area exceed it."""
FITTING = 0.95
"""Least share of the area that fits a cylinder for the cylinder to be chosen automatically."""
LEAST_SIDE = 0.25
"""Least share of the area of the side and the bore of such a cylinder: a thin plate is none."""
MOST_CLOSING = 0.2
"""Largest relative change of the period with which a cylinder is chosen automatically."""
ROUND = 0.17
"""Largest cosine between a normal and the direction around an axis on a surface of revolution: 10 degrees."""
OUTWARD = 0.93
"""Largest cosine between a normal and a direction that a patch follows: 20 degrees."""
SAME_AXIS = 0.985
"""Least cosine between a stated direction and the axis of a cylinder that is chosen: 10 degrees."""
STRETCH = 0.25
"""Largest relative change of a length against the median scale of the coordinates."""
SHARE = 0.95
"""Least share of the area on which coordinates keep lengths within `STRETCH`."""


class Coordinates(NamedTuple):
    """Flat coordinates of a body.

    Attributes:
        name: "texture coordinates", "cylinder", "sphere", "plane" or "patches".
        layout: In mm.
        parts: Names of the charts of a cylinder, sphere or plane.
        line: A sentence about the axis, the centre or the plane; empty without one.
    """

    name: str
    layout: Layout
    parts: tuple[str, ...] = ()
    line: str = ""


@dataclass(frozen=True, eq=False)
class CoordinateSearch:
    """A body whose flat coordinates are sought.

    Attributes:
        base: The body.
        placement: With the projection and the direction.
        tile: Which is to close around the body; None: none is.
        blend_mm: Width of the strip on which neighbouring patches share the surface.
    """

    base: BaseSurface
    placement: Placement
    tile: Tile | None
    blend_mm: float

    @cached_property
    def normals(self) -> Array:
        """(faces, 3) unit normals of the smooth surface."""
        return units(self.base.mesh.normals.sum(axis=1))

    def textured(self) -> tuple[Array, Array, Array]:
        """Middles (n, 3), mm, unit normals (n, 3) and areas (n,), mm², of the textured triangles."""
        body, where = self.base.body, self.base.textured
        return body.vertices[body.faces[where]].mean(axis=1), self.normals[where], body.areas[where]

    def by_charts(self, name: str, charts: list[Chart], line: str) -> Coordinates:
        """Coordinates by charts of the textured triangles."""
        layout = by_charts(self.base.body, charts, self.base.textured, self.blend_mm)
        return Coordinates(name, layout, tuple(chart.name for chart in charts), line)


def found_coordinates(
    base: BaseSurface, placement: Placement, tile: Tile | None, blend_mm: float
) -> Coordinates:
    """The coordinates of the projection that the placement states; arguments as of `CoordinateSearch`.

    Raises:
        InputError: The projection does not go with the body.
    """
    coordinates: Coordinates = resolve_name(PROJECTIONS[placement.projection])(
        CoordinateSearch(base, placement, tile, blend_mm)
    )
    return coordinates


def automatic(search: CoordinateSearch) -> Coordinates:
    """Texture coordinates without a stated direction, or a cylinder, where these keep sizes; else patches."""
    base = search.base
    if search.placement.along is None:
        layout = by_texture_coordinates(base.body, base.uv, base.textured)
        if layout is not None:
            return Coordinates("texture coordinates", layout)
    axis, charts, found = _cylinder(search, None)
    return found if _is_cylinder(search, axis, charts, found.layout) else patches(search)


def texture_coordinates(search: CoordinateSearch) -> Coordinates:
    """The texture coordinates of the mesh, however they change sizes. Raises InputError if it has none."""
    base = search.base
    layout = by_texture_coordinates(base.body, base.uv, base.textured, any_size=True)
    if layout is None:
        raise InputError("projection: uv: the mesh has no texture coordinates")
    return Coordinates("texture coordinates", layout)


def cylinder(search: CoordinateSearch) -> Coordinates:
    """Coordinates around the axis that is stated or found."""
    return _cylinder(search, search.placement.direction)[2]


def sphere(search: CoordinateSearch) -> Coordinates:
    """Coordinates around a centre, with the poles along the direction that is stated, or along z."""
    centre, along = found_centre(*search.textured()), search.placement.direction
    axis = axis_along(centre, np.array([0.0, 0.0, 1.0]) if along is None else along)
    charts = sphere_charts(search.base.body, axis, search.base.textured)
    return search.by_charts("sphere", charts, f"sphere about ({shown_vector(centre)}) mm")


def plane(search: CoordinateSearch) -> Coordinates:
    """Coordinates by the plane that most triangles face. Raises InputError as `plane_charts`."""
    base = search.base
    charts, facing = plane_charts(base.body, search.normals, base.textured, search.placement.direction)
    return search.by_charts("plane", charts, f"plane that faces ({shown_vector(facing)})")


def patches(search: CoordinateSearch) -> Coordinates:
    """Overlapping patches. Raises InputError if the direction lies nowhere in the surface: without effect."""
    base, along = search.base, search.placement.direction
    if along is not None and (np.abs(search.normals[base.textured] @ along) > OUTWARD).all():
        fault = f"along: {shown_vector(along)} points out of the surface everywhere"
        raise InputError(f"{fault}; take a direction that lies in it")
    with stage("flat coordinates", 1.0, at_most=True):
        needed = flagged(base.body.faces[base.textured], len(base.body.vertices))
        scale = max(1.0, base.file.edge_mm / DRAFT_EDGE_MM)
        layout = lay_out(base.body, needed, search.blend_mm, base.normals, along, scale)
        return Coordinates("patches", layout)


def _cylinder(
    search: CoordinateSearch, stated: Array | None
) -> tuple[RevolutionAxis, list[Chart], Coordinates]:
    """The axis along a stated direction (3,), or any axis that fits, its charts, and the coordinates."""
    axis, along = found_axis(*search.textured(), stated), search.placement.direction
    if along is not None and axis.frame[2] @ along < 0.0:
        axis = axis_along(axis.point, -axis.frame[2])
    charts = cylinder_charts(search.base.body, search.normals, axis, search.base.textured)
    line = f"cylinder about the axis ({shown_vector(axis.frame[2])}) through ({shown_vector(axis.point)}) mm"
    return axis, charts, search.by_charts("cylinder", charts, line)


def _is_cylinder(search: CoordinateSearch, axis: RevolutionAxis, charts: list[Chart], layout: Layout) -> bool:
    """Whether a body that nobody calls a cylinder is one: round, long enough, with lengths that are kept."""
    body, where, along = search.base.body, search.base.textured, search.placement.direction
    if along is not None and abs(along @ axis.frame[2]) < SAME_AXIS:
        return False
    around = [chart for chart in charts if np.isfinite(chart.around_mm)]
    side = np.any([chart.faces for chart in around], axis=0) & where
    areas = body.areas
    area, sides = areas[where].sum(), areas[side].sum()
    if sides < LEAST_SIDE * area:
        return False
    local = axis.local(body.vertices[body.faces[side]].mean(axis=1))
    across = np.cross(axis.frame[2], local @ axis.frame)
    off = np.abs((search.normals[side] * across).sum(axis=1)) > ROUND * np.linalg.norm(across, axis=1)
    if areas[side][off].sum() > (1.0 - FITTING) * sides:
        return False
    if areas[where & (layout.stretch > OFF_SIZE)].sum() > (1.0 - FITTING) * area:
        return False
    if search.tile is None:
        return True
    rows, cols = search.tile.size_mm
    closings = [
        closed(chart.around_mm, search.placement.turn_deg, cols, rows)
        for chart in around
        if areas[chart.faces & where].sum() > (1.0 - FITTING) * area
    ]
    return all(abs(closing.scale - 1.0) <= MOST_CLOSING for closing in closings)


def shown_vector(vector: Array) -> str:
    """A vector for a person, to hundredths."""
    return ", ".join(f"{value:.4g}" for value in np.round(vector, 2) + 0.0)


def by_texture_coordinates(
    body: Body, uv: Array | None, where: Flags, *, any_size: bool = False
) -> Layout | None:
    """The layout by texture coordinates; None if there are none, or if they would change the texture's size.

    Args:
        body: The body.
        uv: (faces, 3, 2) texture coordinates of the corners, in any unit.
        where: (faces,) those that carry texture.
        any_size: Whether they are taken however they change the size.
    """
    if uv is None:
        return None
    corners, areas = body.vertices[body.faces], body.areas
    low, high = (np.abs(value) for value in singular_values(corners, uv))
    order = np.argsort(low[where] * high[where])
    middle = np.searchsorted(np.cumsum(areas[where][order]), 0.5 * areas[where].sum())
    scale = float(np.sqrt((low * high)[where][order][middle]))
    if not scale > 0.0:
        return None
    stretch = np.maximum(high / scale - 1.0, 1.0 - low / scale)
    if not any_size and areas[where & (stretch <= STRETCH)].sum() < SHARE * areas[where].sum():
        return None
    return one_patch(where, uv / scale, stretch)
