"""Holes in a plane: cork, pumice, worn concrete."""

import numpy as np

from surrogate.families.basics import Field, coordinates, log_uniform, nearest, rough_noise, scattered, unit
from surrogate.families.texture_grid import Grid


def pores(rng: np.random.Generator, grid: Grid) -> Field:
    """Round pits of three sizes, 0.3-3 mm wide, the smaller the more of them, in a face that may be rough."""
    heights = rng.uniform(0.0, 0.06) * rough_noise(rng, grid, 1.5, 1.2)
    widest = log_uniform(rng, 1.0, 3.0)
    fill = rng.uniform(0.4, 0.95)
    for share in (1.0, 0.55, 0.3):
        width = widest * share
        points = scattered(rng, grid, width * 1.5, 0.6)
        radius = width / 2 * rng.uniform(0.5, 1.2, len(points)) * (rng.random(len(points)) < fill)
        near = nearest(points, *coordinates(grid), 4, grid.period())
        pits = np.sqrt(np.maximum(radius[near.index] ** 2 - near.distance**2, 0.0))
        heights = np.minimum(heights, -pits.max(axis=-1) / widest)
    return unit(heights)
