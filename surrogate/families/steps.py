"""Stepped relief: terraces, stairs, blocks."""

import numpy as np

from relief.ground.arrays import smooth_step
from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


def terraces(rng: np.random.Generator, grid: Grid) -> Field:
    """3 to 9 terraces cut into rolling ground, a slope or a cone; edges 0.08-0.3 of a terrace wide."""
    levels = int(rng.integers(3, 10))
    x, y = basics.coordinates(grid)
    # On a tile, what goes up comes down again.
    right, up = (np.abs(x), np.abs(y)) if grid.periodic else (x, y)
    grounds = [
        basics.smooth_noise(rng, grid, rng.uniform(0.7, 1.8)),
        basics.turned(right, up, rng.uniform(0, np.pi))[0] / 2
        + rng.uniform(0, 0.6) * basics.smooth_noise(rng, grid, 1.0),
        np.hypot(grid.offset(x - rng.uniform(-4, 4)), grid.offset(y - rng.uniform(-4, 4))) / 2
        + 0.3 * basics.smooth_noise(rng, grid, 1.0),
        basics.rough_noise(rng, grid, rng.uniform(3.0, 6.0), 2.2),
    ]
    ground = basics.unit(grounds[rng.integers(len(grounds))]) * levels
    edge = rng.uniform(0.08, 0.3)
    floor = np.floor(ground)
    stepped = floor + smooth_step((ground - floor - 1 + edge) / edge)
    return basics.unit(stepped + rng.uniform(0.0, 0.25) * ground)


def blocks(rng: np.random.Generator, grid: Grid) -> Field:
    """Upright blocks of 0.5-5 mm: the plate is cut in two again and again, each part at its own height."""
    smallest = basics.log_uniform(rng, 0.5, 2.0)
    edge = 0.12
    u, v = basics.turned(*basics.coordinates(grid), grid.direction(basics.any_direction(rng)))
    heights = np.zeros_like(u)
    reach = grid.side_mm / 2 if grid.periodic else grid.side_mm / np.sqrt(2)
    parts = [(-reach, reach, -reach, reach)]
    while parts:
        left, right, bottom, top = parts.pop()
        wide, tall = right - left, top - bottom
        longer = max(wide, tall)
        if longer > 5.0 or (longer > 2 * smallest and rng.random() < 0.85):
            share = rng.uniform(0.35, 0.65)
            if wide > tall:
                cut = left + share * wide
                parts += [(left, cut, bottom, top), (cut, right, bottom, top)]
            else:
                cut = bottom + share * tall
                parts += [(left, right, bottom, cut), (left, right, cut, top)]
            continue
        if grid.periodic:
            across, along = grid.offset(u - (left + right) / 2), grid.offset(v - (bottom + top) / 2)
            inside = np.minimum(wide / 2 - np.abs(across), tall / 2 - np.abs(along))
        else:
            inside = np.minimum(np.minimum(u - left, right - u), np.minimum(v - bottom, top - v))
        heights += rng.random() * smooth_step(inside / edge + 0.5)
    return basics.unit(heights)
