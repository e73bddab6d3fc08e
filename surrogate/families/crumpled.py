"""Flat faces and sharp folds: crumpled paper, foil, split stone."""

import numpy as np
import scipy

from surrogate.families.basics import Field, coordinates, log_uniform, repeats, scattered, smooth_noise, unit
from surrogate.families.texture_grid import Grid


def crumpled(rng: np.random.Generator, grid: Grid) -> Field:
    """Triangles of 1.2-4 mm at random heights, and finer ones folded into them once or twice."""
    spacing = log_uniform(rng, 1.2, 4.0)
    octaves = int(rng.integers(1, 4))
    finer = rng.uniform(0.4, 0.55)
    heights = rng.uniform(0.0, 0.5) * smooth_noise(rng, grid, 1.5)
    for octave in range(octaves):
        heights = heights + finer**octave * _faces(rng, grid, spacing * 0.45**octave)
    return unit(heights)


def _faces(rng: np.random.Generator, grid: Grid, spacing: float) -> Field:
    points = scattered(rng, grid, spacing, 0.45, margin_mm=0.0)
    heights = rng.standard_normal(len(points))
    every = repeats(points, grid.period())
    faces = scipy.interpolate.LinearNDInterpolator(every, np.resize(heights, len(every)))
    return faces(np.stack(coordinates(grid), axis=-1))
