"""Scales that overlap: fish skin, shingles."""

import numpy as np

from relief.ground.arrays import smooth_step
from surrogate.families.basics import Field, any_direction, lattice, log_uniform, unit
from surrogate.families.texture_grid import Grid


def scales(rng: np.random.Generator, grid: Grid) -> Field:
    """Rows of scales 1-3.5 mm wide, each rising toward a free edge that is round, pointed or straight."""
    wide = log_uniform(rng, 1.0, 3.5)
    step = wide * rng.uniform(0.4, 0.6)
    roundness = rng.choice([1.2, 2.0, 6.0])
    arch = rng.uniform(0.0, 0.5)
    u, v = lattice(grid, any_direction(rng), wide, step, (1, 2))
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
    return unit(heights)
