"""Objects from grids of parameters: bracelet and cylinder, turned about z, and a curved plate."""

import math

import numpy as np

from relief.ground.arrays import Array, Index
from relief.solids.body import Body
from relief.solids.export.plate_export import plate_mesh

LINKS = 16
"""Links of the bracelet; an even number, so that two kinds may take turns."""
BRACELET_MM = (33.0, 2.2, 7.5)
"""Radius of the ring to the middle of its band, half the thickness of the band and half its width, mm."""
GROOVE = 0.2
"""Part by which the band is thinner in the middle of the groove between two links."""
GROOVE_POWER = 12
"""Power of the cosine that shapes a groove; the greater, the narrower."""
CURVED_MM = (50.0, 4.0)
"""Side and thickness of the curved plate, mm."""
HILLS = (((-9.0, 0.0), (8.0, 8.0), 7.0), ((25.0, 0.0), (9.0, 14.0), 7.0))
"""Hills of the curved plate: middle, standard deviations along x and y, height, mm.

The first is the maximum; the second lies on the rim, and between both is the saddle.
"""


def bracelet(edge_mm: float = 0.6) -> Body:
    """A bracelet with links: a ring about z whose band is thinner between the links."""
    radius, thick, wide = BRACELET_MM
    around = math.ceil(2.0 * math.pi * (radius + thick) / edge_mm)
    across = math.ceil(4.0 * (thick + wide) / edge_mm)
    turn = 2.0 * np.pi * np.arange(around) / around
    # Points of the section at equal distances, by inverting the length of its outline.
    fine = np.linspace(0.0, 2.0 * np.pi, 20 * across + 1)
    outline = _superellipse(fine, thick, wide)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(outline, axis=0), axis=1))])
    at = np.interp(lengths[-1] * np.arange(across) / across, lengths, fine)
    section = _superellipse(at, thick, wide)
    scale = 1.0 - GROOVE * np.cos(0.5 * LINKS * turn) ** GROOVE_POWER
    out = radius + scale[:, None] * section[:, 0]
    points = _turned(out, turn[:, None], scale[:, None] * section[:, 1])
    return Body(points, _grid_faces(around, across))


def link_of(points: Array) -> Index:
    """Number of the link that points (n, 3) of the bracelet belong to, 0 to `LINKS` - 1."""
    turn = np.arctan2(points[:, 1], points[:, 0]) / (2.0 * np.pi) % 1.0
    return np.minimum((turn * LINKS).astype(np.intp), LINKS - 1)


def cylinder(radius_mm: float = 15.0, length_mm: float = 40.0, edge_mm: float = 0.8) -> Body:
    """A cylinder about z that stands at z = 0, with flat ends."""
    around = math.ceil(2.0 * math.pi * radius_mm / edge_mm)
    rings = math.ceil(length_mm / edge_mm) + 1
    caps = math.ceil(radius_mm / edge_mm)
    inward = radius_mm * np.arange(caps - 1, 0, -1) / caps
    radii = np.concatenate([inward[::-1], np.full(rings, radius_mm), inward])
    heights = np.concatenate(
        [np.zeros(caps - 1), np.linspace(0.0, length_mm, rings), np.full(caps - 1, length_mm)]
    )
    turn = 2.0 * np.pi * np.arange(around) / around
    points = _turned(radii[:, None], turn, heights[:, None])
    index = np.arange(len(points)).reshape(len(radii), around)
    after = np.roll(index, -1, axis=1)
    a, b, c, d = index[:-1], after[:-1], after[1:], index[1:]
    sides = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    south, north = len(points), len(points) + 1
    bottom = np.stack([np.full(around, south), after[0], index[0]], axis=-1)
    top = np.stack([np.full(around, north), index[-1], after[-1]], axis=-1)
    ends = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, length_mm]])
    return Body(np.concatenate([points, ends]), np.concatenate([sides, bottom, top]))


def curved(edge_mm: float = 0.8) -> Body:
    """A plate with a hill, a saddle and a rise to the rim: the paper's shape with a maximum and a saddle."""
    side, thick = CURVED_MM
    samples = math.ceil(side / edge_mm)
    at = (np.arange(samples) + 0.5) * side / samples - 0.5 * side
    heights = sum(
        height * np.outer(np.exp(-0.5 * ((at[::-1] - y) / sy) ** 2), np.exp(-0.5 * ((at - x) / sx) ** 2))
        for (x, y), (sx, sy), height in HILLS
    )
    body = plate_mesh(heights, side, thick)
    return Body(body.vertices + np.array([0.0, 0.0, thick]), body.faces)


def _turned(radii: Array, turns: Array, heights: Array) -> Array:
    """(n, 3) points at radii, turns, rad, and heights about z, which are broadcast against each other."""
    x, y, z = np.broadcast_arrays(radii * np.cos(turns), radii * np.sin(turns), heights)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def _superellipse(angle: Array, thick: float, wide: float) -> Array:
    """Points (n, 2) of a superellipse of power 4, counter-clockwise."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.column_stack(
        [thick * np.sign(cosine) * np.sqrt(np.abs(cosine)), wide * np.sign(sine) * np.sqrt(np.abs(sine))]
    )


def _grid_faces(around: int, across: int) -> Index:
    """Triangles of a grid that closes both ways, as the surface of a ring."""
    index = np.arange(around * across).reshape(around, across)
    right, up = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    both = np.roll(right, -1, axis=1)
    return np.stack([index, right, both, index, both, up], axis=-1).reshape(-1, 3)
