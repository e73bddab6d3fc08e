"""Grounds that fall into cells: leather, cracked mud."""

import numpy as np

from relief.ground.arrays import smooth_step
from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


def leather(rng: np.random.Generator, grid: Grid) -> Field:
    """Cushions 0.5-2 mm wide with soft furrows between them, on the swell and the creases of a hide."""
    spacing = basics.log_uniform(rng, 0.5, 2.0)
    x, y = basics.coordinates(grid)
    bend = spacing * rng.uniform(0.02, 0.1)
    x = x + bend * basics.smooth_noise(rng, grid, 0.8 * spacing)
    squeeze = rng.uniform(1.0, 1.6)
    x = x / squeeze
    y = y + bend * basics.smooth_noise(rng, grid, 0.8 * spacing)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.35, 0.6), squeeze=squeeze)
    distance, cell = basics.border_distance(points, x, y, grid.period(squeeze))
    cushions = basics.dome(1 - np.minimum(distance / (spacing * rng.uniform(0.2, 0.45)), 1.0))
    tall = rng.uniform(0.75, 1.0, len(points))[cell]
    folds = basics.scattered(rng, grid, spacing * rng.uniform(3, 5), 0.5, squeeze=squeeze)
    creases, _ = basics.border_distance(folds, x, y, grid.period(squeeze))
    creased = smooth_step(0.35 + creases / (0.5 * spacing))
    swell = rng.uniform(0.02, 0.15) * basics.smooth_noise(rng, grid, rng.uniform(1.0, 2.0))
    return basics.unit(
        cushions * tall * creased + swell + rng.uniform(0.0, 0.04) * basics.rough_noise(rng, grid, 0.6, 1.0)
    )


def cracked(rng: np.random.Generator, grid: Grid) -> Field:
    """Plates 1.2-4 mm wide that shrank apart: steep cracks, curled rims, finer cracks in the plates."""
    spacing = basics.log_uniform(rng, 1.2, 4.0)
    crack = rng.uniform(0.1, 0.3)
    x, y = basics.coordinates(grid)
    bend = spacing * rng.uniform(0.02, 0.06)
    x = x + bend * basics.rough_noise(rng, grid, spacing, 1.8)
    y = y + bend * basics.rough_noise(rng, grid, spacing, 1.8)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.35, 0.6))
    distance, cell = basics.border_distance(points, x, y, grid.period())
    plate = points[cell]
    tilt = rng.normal(0.0, rng.uniform(0.0, 0.12) / spacing, points.shape)[cell]
    tilted = tilt[..., 0] * grid.offset(x - plate[..., 0]) + tilt[..., 1] * grid.offset(y - plate[..., 1])
    curl = rng.uniform(0.0, 0.3) * np.exp(-distance / (0.2 * spacing))
    shards = basics.scattered(rng, grid, spacing / rng.uniform(2.0, 3.0), 0.5)
    finer, _ = basics.border_distance(shards, x, y, grid.period())
    hairlines = rng.uniform(0.0, 0.2) * (1 - smooth_step(finer / (0.5 * crack + 0.08)))
    grain = rng.uniform(0.0, 0.03) * basics.rough_noise(rng, grid, 1.0, 1.2)
    level = 1 + tilted + curl - hairlines + grain
    return basics.unit(level * smooth_step((distance - crack / 4) / (crack + 0.08)))
