"""Dots in a lattice: embossed leather, grips, chequer plate."""

from collections.abc import Callable

import numpy as np

from relief.ground.arrays import smooth_step
from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid

_SHAPES: tuple[Callable[[Field, Field], Field], ...] = (
    lambda x, y: basics.dome(np.hypot(x, y)),
    lambda x, y: np.maximum(1 - np.hypot(x, y), 0.0),
    lambda x, y: smooth_step((1 - np.hypot(x, y)) / 0.35),
    lambda x, y: np.maximum(1 - np.maximum(np.abs(x), np.abs(y)), 0.0),
    lambda x, y: smooth_step((1 - np.maximum(np.abs(x), np.abs(y))) / 0.35),
    lambda x, y: basics.dome((np.hypot(x, y) - 0.7) / 0.3),
)
"""Heights in [0, 1] over coordinates in dot radii: dome, cone, disc, pyramid, square stud, ring."""


def dots(rng: np.random.Generator, grid: Grid) -> Field:
    """One shape (dome, cone, disc, pyramid, stud, ring) in a hexagonal or square lattice of 0.8-4 mm."""
    spacing = basics.log_uniform(rng, 0.8, 4.0)
    radius = spacing * rng.uniform(0.3, 0.5)
    angle = basics.any_direction(rng)
    shape = _SHAPES[rng.integers(len(_SHAPES))]
    if rng.random() < 0.5:
        u, v = basics.turned(*basics.coordinates(grid), grid.direction(angle))
        points = basics.scattered(rng, grid, spacing, rng.choice([0.0, 0.0, 0.1]), margin_mm=3.0)
        near = basics.nearest(points, u, v, 1, grid.period())
        return basics.unit(shape(near.dx[..., 0] / radius, near.dy[..., 0] / radius))
    u, v = basics.lattice(grid, angle, spacing, spacing)
    start = rng.random(2)
    dx = ((u / spacing + start[0]) % 1.0 - 0.5) * spacing
    dy = ((v / spacing + start[1]) % 1.0 - 0.5) * spacing
    return basics.unit(shape(dx / radius, dy / radius))


def chequer_plate(rng: np.random.Generator, grid: Grid) -> Field:
    """Long lens-shaped studs 1.5-4 mm apart, every other one turned by a right angle, as on steel floors."""
    spacing = basics.log_uniform(rng, 1.5, 4.0)
    length = spacing * rng.uniform(0.55, 0.68)
    width = length * rng.uniform(0.25, 0.4)
    u, v = basics.lattice(grid, basics.any_direction(rng), spacing, spacing, (2, 2))
    u, v = u / spacing + rng.random(), v / spacing + rng.random()
    flipped = (np.floor(u) + np.floor(v)) % 2 == 1
    du, dv = (u % 1.0 - 0.5) * spacing, (v % 1.0 - 0.5) * spacing
    along, across = basics.turned(np.where(flipped, -dv, du), np.where(flipped, du, dv), np.pi / 4)
    return basics.unit(smooth_step((1 - (along / length) ** 2 - np.abs(across) / width) / 0.7))
