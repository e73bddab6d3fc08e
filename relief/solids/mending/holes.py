"""Round holes of a body, through and blind, recognised by the faces of their walls.

A wall is a connected set of faces whose edges are flat, or concave with a bend below `WIDEST_BEND`. A wall is
that of a round hole if its corners lie on a circle seen along one axis, to which its normals are
perpendicular, if the normals point towards that axis, and if corners lie all around. Faces beside a wall that
lie within the same cylinder belong to the hole: floors, tips of drills. So do faces that face the axis within
a cylinder of the largest diameter: countersinks, rounded rims.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from relief.ground.arrays import Array, Index, smooth_step, units
from relief.solids.body import Body
from relief.solids.meshes.neighbourhood import connected, edge_ends, edge_pairs, points_along

WIDEST_BEND = 50.0
"""Widest angle between facets of a wall, degrees: eight facets have 45, a drill's tip 59."""
LEAST_BEND = 0.2
"""Angle, degrees, up to which convex edges count as flat: more than rounding makes of narrow facets."""
ROUND = 0.02
"""Deviation of corners from the circle, as a share of its radius."""
UPRIGHT = 0.02
"""Sine of the angle between a wall and its axis, in the mean square."""
LARGEST_GAP = 120.0
"""Widest angle without corners on the circle, degrees: a bore for a shaft with a flat has 90 or more."""
LEAST_INWARD = 0.2
"""Mean cosine, at least, between the way to the axis and the normals of what widens a hole."""
FEWEST_FACES = 12
"""Triangles of a wall at least: those of six facets."""
BESIDE, BESIDE_MM = 1e-3, 0.05
"""Distance from the cylinder within which a point lies in the hole, a share of its radius and mm more:
beside the flat of a D-shaped bore of 6 mm the smooth surface leaves the cylinder by 0.012 mm, and no printer
makes a wall of 0.05 mm."""
RIM_MM = 0.1
"""Largest distance of the sample points of rims of holes and of the bottom, mm."""


@dataclass(frozen=True, eq=False)
class Holes:
    """Holes of a body.

    Attributes:
        diameters_mm: (k,) of the holes.
        cylinders: In which their faces lie: point, unit axis, radius, and both ends along the axis from the
            point, mm.
        rim: (n, 3) points where holes meet the rest of the surface, mm.
    """

    diameters_mm: Array
    cylinders: list[tuple[Array, Array, float, float, float]]
    rim: Array

    def share(self, places: Array, falloff_mm: float) -> Array:
        """Share (n,) of the texture at points (n, 3): 0 in a hole, 1 at the falloff or farther."""
        far, _ = cKDTree(self.rim).query(places, distance_upper_bound=falloff_mm)
        share = smooth_step(np.minimum(far, falloff_mm) / falloff_mm)
        order = np.argsort(places[:, 0])
        rising = places[order, 0]
        for point, axis, radius, low, high in self.cylinders:
            slack = BESIDE * radius + BESIDE_MM
            middle, half = point + 0.5 * (low + high) * axis, 0.5 * (high - low) + slack
            # Of many points few lie beside a hole.
            reach = np.hypot(radius + slack, half)
            some = order[slice(*np.searchsorted(rising, [middle[0] - reach, middle[0] + reach]))]
            way = places[some] - middle
            along = way @ axis
            across = np.linalg.norm(way - along[:, None] * axis, axis=1)
            share[some[(across <= radius + slack) & (np.abs(along) <= half)]] = 0.0
        return np.asarray(share)


def round_holes(body: Body, most_mm: float) -> Holes | None:
    """The round holes up to a diameter, mm; None if there are none.

    Args:
        body: Closed, with one position per vertex.
        most_mm: Largest diameter.
    """
    pairs = edge_pairs(body.faces)
    part = _walls(body, pairs)
    order = np.argsort(part, kind="stable")
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    ends = np.append(starts[1:], len(order))
    beside = part[pairs // 3]
    beside = beside[beside[:, 0] != beside[:, 1]]
    near = sp.coo_matrix((np.ones(len(beside), bool), beside.T), (len(starts),) * 2)
    near = (near + near.T).tocsr()
    diameters, cylinders, kept = [], [], np.zeros(len(starts), bool)
    # Some face of a wall that goes around faces the first one of that wall.
    normals = body.normals[order]
    towards = np.minimum.reduceat((normals * normals[starts[part[order]]]).sum(axis=1), starts)
    for number in np.flatnonzero((towards <= 0.0) & (ends - starts >= FEWEST_FACES)):
        circle = _circle(body, order[starts[number] : ends[number]], 0.5 * most_mm)
        if circle is None:
            continue
        diameters.append(2.0 * circle[2])
        reached, waiting = {number}, [number]
        while waiting:
            one = waiting.pop()
            within = _within(body, order[starts[one] : ends[one]], *circle, 0.5 * most_mm)
            if within is not None:
                cylinders.append((circle[0], circle[1], *within))
                kept[one] = True
                further = set(near[one].indices.tolist()) - reached
                reached |= further
                waiting += further
    if not diameters:
        return None
    half = pairs[kept[part[pairs // 3]].sum(axis=1) == 1, 0]
    ends = body.vertices[np.stack(edge_ends(body.faces), axis=1)[half]]
    return Holes(np.array(diameters), cylinders, points_along(ends, RIM_MM))


def _walls(body: Body, pairs: Index) -> Index:
    """(m,) number of the wall that each face belongs to."""
    normals = units(body.normals)
    one, other = pairs.T // 3
    bend = np.degrees(np.arccos(np.clip((normals[one] * normals[other]).sum(axis=1), -1.0, 1.0)))
    # The far corner of the other face lies before a face at a concave edge.
    corner = body.faces[other, (pairs[:, 1] + 2) % 3]
    before = ((body.vertices[corner] - body.vertices[body.faces[one, 0]]) * normals[one]).sum(axis=1)
    joined = (bend <= LEAST_BEND) | ((before > 0.0) & (bend <= WIDEST_BEND))
    return connected(pairs[joined] // 3, len(body.faces))


def _circle(body: Body, group: Index, most_mm: float) -> tuple[Array, Array, float] | None:
    """Point, unit axis and radius, mm, of the round hole that faces (k,) are the wall of, if they are one."""
    faces = Body(body.vertices, body.faces[group])
    normals, corners = faces.normals, body.vertices[np.unique(faces.faces)]
    values, vectors = np.linalg.eigh(normals.T @ normals)
    axis, across = vectors[:, 0], vectors[:, 1:]
    if values[0] > UPRIGHT**2 * values.sum():
        return None
    middle = corners.mean(axis=0)
    flat = (corners - middle) @ across
    fit = np.linalg.lstsq(np.c_[2.0 * flat, np.ones(len(flat))], (flat**2).sum(axis=1), rcond=None)[0]
    offsets = flat - fit[:2]
    distance = np.linalg.norm(offsets, axis=1)
    radius = float(distance.mean())
    if radius > most_mm * (1.0 + BESIDE) or np.abs(distance - radius).max() > ROUND * radius:
        return None
    angles = np.sort(np.degrees(np.arctan2(*offsets.T)))
    gap = np.diff(angles, append=angles[0] + 360.0).max()
    point = middle + across @ fit[:2]
    inward = ((point - body.vertices[faces.faces].mean(axis=1)) * normals).sum()
    return (point, axis, radius) if gap <= LARGEST_GAP and inward > 0.0 else None


def _within(
    body: Body, group: Index, point: Array, axis: Array, radius: float, most_mm: float
) -> tuple[float, float, float] | None:
    """Radius and ends of the cylinder around an axis that holds faces (k,), if they belong to the hole."""
    faces = Body(body.vertices, body.faces[group])
    corners = body.vertices[np.unique(faces.faces)] - point
    along = corners @ axis
    wide = float(np.linalg.norm(corners - along[:, None] * axis, axis=1).max())
    if wide > radius * (1.0 + ROUND):
        way = point - body.vertices[faces.faces].mean(axis=1)
        way -= (way @ axis)[:, None] * axis
        inward = (way * faces.normals).sum() / (np.linalg.norm(way, axis=1) * 2.0 * faces.areas).sum()
        if wide > most_mm * (1.0 + ROUND) or inward < LEAST_INWARD:
            return None
    return wide, float(along.min()), float(along.max())
