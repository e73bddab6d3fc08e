"""Patterns on a lattice: dots, chequer plate, ribs, waffles, fish skin and shingles."""

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


def _ribs(rng: np.random.Generator) -> Callable[[Field], Field]:
    """A profile over one period: from a place in [0, 1) to a height in [0, 1], continuous around."""
    duty = rng.uniform(0.3, 0.7)
    edge = rng.uniform(0.12, 0.25)
    peak = rng.uniform(0.1, 0.9)
    sharpness = basics.log_uniform(rng, 0.5, 4.0)
    profiles: list[Callable[[Field], Field]] = [
        lambda t: 0.5 + 0.5 * np.cos(2 * np.pi * t),
        lambda t: (0.5 + 0.5 * np.cos(2 * np.pi * t)) ** sharpness,
        lambda t: np.where(t < peak, t / peak, (1 - t) / (1 - peak)),
        lambda t: smooth_step((duty / 2 - np.abs(t - 0.5)) / edge + 0.5),
        lambda t: basics.dome((t - 0.5) / max(duty, 0.45)),
    ]
    return profiles[rng.integers(len(profiles))]


def grating(rng: np.random.Generator, grid: Grid) -> Field:
    """Ribs of period 0.6-5 mm in any direction: sinusoidal, sharp, triangular, flat-topped or round.

    Some wander by up to a third of a period.
    """
    period = basics.log_uniform(rng, 0.6, 5.0)
    across, _ = basics.lattice(grid, basics.any_direction(rng), period, period)
    place = across / period + rng.random()
    if rng.random() < 0.4:
        place = place + rng.uniform(0.05, 0.3) * basics.smooth_noise(rng, grid, rng.uniform(1.0, 2.5))
    return basics.unit(_ribs(rng)(place % 1.0))


def crossed(rng: np.random.Generator, grid: Grid) -> Field:
    """Two gratings of period 0.6-3 mm, 60-90 degrees apart: pyramids, waffles, knurls, studs."""
    angle = basics.any_direction(rng)
    period = basics.log_uniform(rng, 0.6, 3.0)
    second_period = period if rng.random() < 0.6 else basics.log_uniform(rng, 0.6, 3.0)
    second_angle = angle + (np.pi / 2 if rng.random() < 0.6 else rng.uniform(np.pi / 3, np.pi / 2))
    profile = _ribs(rng)
    first = profile((basics.lattice(grid, angle, period, period)[0] / period + rng.random()) % 1.0)
    across, _ = basics.lattice(grid, second_angle, second_period, second_period)
    second = profile((across / second_period + rng.random()) % 1.0)
    together = [np.minimum(first, second), np.maximum(first, second), first * second, first + second]
    return basics.unit(together[rng.integers(len(together))])


def scales(rng: np.random.Generator, grid: Grid) -> Field:
    """Rows of scales 1-3.5 mm wide, each rising toward a free edge that is round, pointed or straight."""
    wide = basics.log_uniform(rng, 1.0, 3.5)
    step = wide * rng.uniform(0.4, 0.6)
    roundness = rng.choice([1.2, 2.0, 6.0])
    arch = rng.uniform(0.0, 0.5)
    u, v = basics.lattice(grid, basics.any_direction(rng), wide, step, (1, 2))
    u, v = u / wide + rng.random(), v / step + rng.random()
    heights = np.zeros_like(u)
    row = np.floor(v)
    for shift in range(3):
        of_row = row + shift
        across = (u + 0.5 * (of_row % 2)) % 1.0 * 2 - 1
        down = (of_row - v) / 2
        rim = 1 - np.abs(across) ** roundness - np.maximum(down, 0.0) ** roundness
        rise = 0.3 + 0.7 * down - arch * across**2 * 0.5
        heights = np.maximum(heights, rise * smooth_step(rim / 0.25))
    return basics.unit(heights)
