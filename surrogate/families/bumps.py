"""Round bumps and dents at random places: embossed card, hammered metal."""

import numpy as np

from surrogate.families.basics import Field, coordinates, log_uniform, nearest, rough_noise, scattered, unit
from surrogate.families.texture_grid import Grid


def bumps(rng: np.random.Generator, grid: Grid) -> Field:
    """Bell-shaped bumps 0.6-3 mm apart at random places, of differing width and height, on flat ground."""
    spacing = log_uniform(rng, 0.6, 3.0)
    points = scattered(rng, grid, spacing, rng.uniform(0.1, 0.6))
    widths = spacing * rng.uniform(0.15, 0.4) * rng.uniform(0.6, 1.2, len(points))
    tall = rng.uniform(rng.uniform(0.1, 0.9), 1.0, len(points))
    near = nearest(points, *coordinates(grid), 6, grid.period())
    bells = tall[near.index] * np.exp(-((near.distance / widths[near.index]) ** 2) / 2)
    return unit(bells.max(axis=-1))


def hammered(rng: np.random.Generator, grid: Grid) -> Field:
    """Shallow dents 0.8-3.5 mm apart that cut into one another, with crisp ridges between them."""
    spacing = log_uniform(rng, 0.8, 3.5)
    points = scattered(rng, grid, spacing, rng.uniform(0.2, 0.6))
    radius = spacing * rng.uniform(0.8, 1.25, len(points))
    depth = rng.uniform(0.0, 0.3, len(points))
    near = nearest(points, *coordinates(grid), 6, grid.period())
    dents = (near.distance / radius[near.index]) ** 2 - depth[near.index]
    return unit(dents.min(axis=-1) + rng.uniform(0.0, 0.02) * rough_noise(rng, grid, 2.0, 1.2))
