"""Flat coordinates by an axis, a centre or a direction: cylinder, sphere and plane, each of a few charts.

A chart is a part of the surface with coordinates of its own: the side of a body, its bore, its ends. Charts
are blended along the lines on which they meet, as patches are.
"""

from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array, Flags, quantiles
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import ways_from
from relief.solids.wrapping.coordinates.layout import Layout, shares_of, stretches
from relief.solids.wrapping.coordinates.revolution import RevolutionAxis, axis_along

END = 0.8
"""Least cosine of the angle between the axis and the normal of a face of an end cap: 37 degrees, which few
chamfers have, and at which the plane of a cap stretches by a quarter."""
BELT = 40.0
"""Latitude up to which a ball has the coordinates of its belt, degrees: there belt and caps stretch alike."""
ACROSS = 0.1
"""Largest cosine by which a triangle may face away from a direction and still be in the chart that faces
it."""
STEP_MM = 0.5
"""Distance of the heights at which the slope of a side is averaged, mm."""
ALIKE = 0.05
"""Largest difference of the areas of front and back that count as equal, relative to their sum."""
PARALLEL = 0.94
"""Least cosine between two directions that count as the same: 20 degrees."""
UPRIGHT = 0.02
"""Share of the area that is added to faces along z, to break ties."""
LEAST_SHARE = 1e-6
"""Least share of the area of a chart."""


class Chart(NamedTuple):
    """A part of a surface and its coordinates.

    Attributes:
        name: For messages.
        faces: (faces,) which triangles it has.
        uv: (faces, 3, 2) coordinates of the corners of all triangles, mm.
        around_mm: Circumference of the body along u, mm; infinite for charts that are not periodic.
    """

    name: str
    faces: Flags
    uv: Array
    around_mm: float


def by_charts(body: Body, charts: list[Chart], where: Flags, blend_mm: float) -> Layout:
    """The layout by charts, each triangle of `where` (faces,) in one, blended over about `blend_mm`."""
    count = len(body.faces)
    touched = np.zeros((len(body.vertices), len(charts)), bool)
    for number, chart in enumerate(charts):
        touched[body.faces[chart.faces], number] = True
    far = np.stack([ways_from(body, marked, blend_mm) for marked in touched.T], axis=1)
    weight = np.maximum(1.0 - far / blend_mm, 0.0)[body.faces].transpose(0, 2, 1) ** 2
    weight = shares_of(np.where(where[:, None, None], weight, 0.0))
    uv = np.stack([chart.uv for chart in charts], axis=1)
    patch = np.where(weight.any(axis=2), np.arange(len(charts)), -1)
    layout = Layout(
        patch, uv, weight, np.zeros(count), len(charts), np.array([chart.around_mm for chart in charts])
    )
    layout.stretch[where] = stretches(
        body.vertices[body.faces[where]], uv[np.flatnonzero(where), layout.leading()[where]]
    )
    return layout


def cylinder_charts(body: Body, normals: Array, axis: RevolutionAxis, where: Flags) -> list[Chart]:
    """Side, bore and ends of a body about an axis.

    Along the side the way of the outline counts, so that cones keep lengths along their sides.

    Args:
        body: Triangles of about 1 mm.
        normals: (faces, 3) unit normals.
        axis: That of the body.
        where: (faces,) triangles that carry texture.
    """
    corners, upright = axis.local(body.vertices[body.faces]), normals @ axis.frame[2]
    middles = corners.mean(axis=1)
    away = middles[:, :2] / np.maximum(np.linalg.norm(middles[:, :2], axis=1, keepdims=True), 1e-12)
    outward = (normals @ axis.frame[:2].T * away).sum(axis=1) >= -ACROSS
    end = np.abs(upright) > END
    angle = _unwrapped(np.arctan2(corners[..., 1], corners[..., 0]))

    def around(name: str, faces: Flags, sign: float) -> Chart:
        """The chart around the axis, with the way along the outline, to the other side in a bore."""
        used = faces & where
        if not used.any():
            return Chart(name, faces, corners[..., :2], np.inf)
        far = np.linalg.norm(middles[used, :2], axis=1)
        radius = float(quantiles(far, body.areas[used], 0.5))
        along = _outline(corners[..., 2], upright, body.areas, used)
        return Chart(name, faces, np.stack([sign * radius * angle, along], axis=-1), 2.0 * np.pi * radius)

    charts = [
        around("side", ~end & outward, 1.0),
        around("bore", ~end & ~outward, -1.0),
        Chart("upper end", end & (upright > 0.0), corners[..., :2], np.inf),
        Chart("lower end", end & (upright < 0.0), corners[..., :2] * (1.0, -1.0), np.inf),
    ]
    return _with_area(charts, body.areas, where)


def _with_area(charts: list[Chart], areas: Array, where: Flags) -> list[Chart]:
    least = LEAST_SHARE * areas[where].sum()
    return [chart for chart in charts if areas[chart.faces & where].sum() > least]


def _unwrapped(angle: Array) -> Array:
    """Angles (faces, 3) rad of corners, those of a triangle next to one another."""
    return np.asarray(angle[:, :1] + (angle - angle[:, :1] + np.pi) % (2.0 * np.pi) - np.pi)


def _outline(height: Array, upright: Array, areas: Array, used: Flags) -> Array:
    """Ways (faces, 3) along the outline at heights of corners, mm, by the mean slope of triangles there."""
    low, high = float(height[used].min()), float(height[used].max())
    count = max(int((high - low) / STEP_MM), 1)
    edges = np.linspace(low, high, count + 1)
    place = np.clip(np.searchsorted(edges, height[used].mean(axis=1)) - 1, 0, count - 1)
    longer = 1.0 / np.sqrt(np.maximum(1.0 - upright[used] ** 2, 1.0 - END**2))
    total = np.bincount(place, areas[used], count)
    slope = np.bincount(place, areas[used] * longer, count)
    slope = np.divide(slope, total, out=np.ones(count), where=total > 0.0)
    ways = np.concatenate([[0.0], np.cumsum(slope * np.diff(edges))])
    return np.asarray(np.interp(height, edges, ways + low))


def sphere_charts(body: Body, axis: RevolutionAxis, where: Flags) -> list[Chart]:
    """Belt and caps of a body about a centre, the point of the axis; arguments as of `cylinder_charts`."""
    corners = axis.local(body.vertices[body.faces])
    far = np.linalg.norm(corners[where].mean(axis=1), axis=1)
    radius = float(quantiles(far, body.areas[where], 0.5))
    across = np.linalg.norm(corners[..., :2], axis=-1)
    latitude = np.arctan2(corners[..., 2], across)
    middle = np.degrees(latitude.mean(axis=1))
    belt = np.abs(middle) <= BELT
    ring = radius
    if (belt & where).any():
        cosines = np.cos(latitude[belt & where].mean(axis=1))
        ring = radius * float(quantiles(cosines, body.areas[belt & where], 0.5))
    angle = _unwrapped(np.arctan2(corners[..., 1], corners[..., 0]))
    out = radius * (0.5 * np.pi - np.abs(latitude))
    polar = corners[..., :2] * (out / np.maximum(across, 1e-12))[..., None]
    charts = [
        Chart("belt", belt, np.stack([ring * angle, radius * latitude], axis=-1), 2.0 * np.pi * ring),
        Chart("upper cap", ~belt & (middle > 0.0), polar, np.inf),
        Chart("lower cap", ~belt & (middle < 0.0), polar * (1.0, -1.0), np.inf),
    ]
    return _with_area(charts, body.areas, where)


def plane_charts(body: Body, normals: Array, where: Flags, top: Array | None) -> tuple[list[Chart], Array]:
    """Front and back of a body by a plane, and the direction (3,) that the front faces.

    Args:
        body: Triangles of about 1 mm.
        normals: (faces, 3) unit normals.
        where: (faces,) triangles that carry texture.
        top: (3,) where the texture's top points; None: +y.

    Raises:
        InputError: The top points where most triangles face.
    """
    areas = body.areas * where
    facing = _facing(np.einsum("n,ni,nj->ij", areas, normals, normals), top)
    towards = normals @ facing
    # The front is the side with more area, and of two alike that which points up.
    sides = (areas * np.sign(towards)).sum() / areas.sum()
    if sides < -ALIKE or (abs(sides) <= ALIKE and facing[np.argmax(np.abs(facing))] < 0.0):
        facing, towards = -facing, -towards
    flat = axis_along(np.zeros(3), facing, top).local(body.vertices[body.faces])[..., :2]
    charts = [
        Chart("front", towards >= -ACROSS, flat, np.inf),
        Chart("back", towards < -ACROSS, flat * (-1.0, 1.0), np.inf),
    ]
    return _with_area(charts, body.areas, where), facing


def _facing(spread: Array, top: Array | None) -> Array:
    """The direction (3,) that most normals have or are against, by the sums (3, 3) of their products."""
    # Of equal directions, as of a cube, the nearest to z.
    values, vectors = np.linalg.eigh(spread + UPRIGHT * np.trace(spread) * np.diag([0.0, 0.0, 1.0]))
    if top is None or abs(vectors[:, 2] @ top) < PARALLEL:
        return np.asarray(vectors[:, 2])
    if values[1] < 0.5 * values[2]:
        place = ", ".join(f"{part:.2g}" for part in vectors[:, 2])
        raise InputError(f"along: the plane faces ({place}), and the texture's top cannot point there")
    return np.asarray(vectors[:, 1])
