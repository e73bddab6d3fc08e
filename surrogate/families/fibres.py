"""Strands laid over one another: felt, straw, coarse paper."""

import numpy as np

from surrogate.families.basics import Field, any_direction, coordinates, dome, log_uniform, turned, unit
from surrogate.families.texture_grid import Grid


def fibres(rng: np.random.Generator, grid: Grid) -> Field:
    """40-160 bent strands a plate, 0.3-1 mm thick at random depths, in every direction or combed into one."""
    x, y = coordinates(grid)
    thick = log_uniform(rng, 0.3, 1.0)
    count = int(np.clip(rng.uniform(40, 70) / thick, 40, 160) * grid.plates)
    main, spread = any_direction(rng), rng.choice([0.4, np.pi])
    depth = rng.uniform(1.0, 3.0)
    heights = np.full_like(x, -depth)
    for _ in range(count):
        along, across = turned(x, y, main + spread * rng.uniform(-0.5, 0.5))
        start, side = rng.uniform(-0.6, 0.6, 2) * grid.side_mm
        bend, wave, pace = rng.normal(0.0, 0.03), rng.normal(0.0, 0.15), rng.uniform(0.5, 1.5)
        radius = thick / 2 * rng.uniform(0.7, 1.2)
        level = -depth * rng.random()
        along = along - start
        offset = (across - side - bend * along**2 - wave * np.sin(pace * along)) / radius
        strand = level + dome(offset)
        heights = np.where((np.abs(offset) < 1) & (strand > heights), strand, heights)
    return unit(heights)
