"""Grounds that fall into cells: leather, cracked mud, crumpled paper, tiles and bricks."""

import numpy as np
import scipy
from numpy.typing import NDArray

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


def crumpled(rng: np.random.Generator, grid: Grid) -> Field:
    """Triangles of 1.2-4 mm at random heights, and finer ones folded into them once or twice."""
    spacing = basics.log_uniform(rng, 1.2, 4.0)
    octaves = int(rng.integers(1, 4))
    finer = rng.uniform(0.4, 0.55)
    heights = rng.uniform(0.0, 0.5) * basics.smooth_noise(rng, grid, 1.5)
    for octave in range(octaves):
        heights = heights + finer**octave * _faces(rng, grid, spacing * 0.45**octave)
    return basics.unit(heights)


def _faces(rng: np.random.Generator, grid: Grid, spacing: float) -> Field:
    points = basics.scattered(rng, grid, spacing, 0.45, margin_mm=0.0)
    heights = rng.standard_normal(len(points))
    every = basics.repeats(points, grid.period())
    faces = scipy.interpolate.LinearNDInterpolator(every, np.resize(heights, len(every)))
    return faces(np.stack(basics.coordinates(grid), axis=-1))


def tiles(rng: np.random.Generator, grid: Grid) -> Field:
    """Square tiles, bricks or hexagons 1-4 mm wide; joints of 0.15-0.4 mm, rounded edges.

    Every tile has a level and a tilt of its own, and a face that may be rough.
    """
    wide = basics.log_uniform(rng, 1.0, 4.0)
    u, v = basics.turned(*basics.coordinates(grid), basics.any_direction(rng))
    patterns = ("square", "brick", "hexagon")
    pattern = patterns[rng.integers(len(patterns))]
    if pattern == "hexagon":
        points = basics.scattered(rng, grid, wide, 0.0, margin_mm=3.0)
        inside, tile = basics.border_distance(points, u, v)
    else:
        tall = wide * (rng.uniform(0.35, 0.6) if pattern == "brick" else 1.0)
        bond = rng.choice([1 / 2, 1 / 3]) if pattern == "brick" else 0.0
        inside, tile = _courses(u / wide + rng.random(), v / tall + rng.random(), wide, tall, bond)
    joint = rng.uniform(0.15, 0.4)
    rounding = rng.uniform(0.12, 0.35)
    count = int(tile.max()) + 1
    level = rng.uniform(1 - rng.uniform(0.0, 0.35), 1.0, count)[tile]
    tilt = rng.normal(0.0, rng.uniform(0.0, 0.06), (count, 2))[tile]
    face = level + tilt[..., 0] * np.sin(u) + tilt[..., 1] * np.sin(v)
    rough = rng.uniform(0.0, 0.08) * basics.rough_noise(rng, grid, 1.2, 1.2)
    return basics.unit((face + rough) * smooth_step((inside - joint / 2) / rounding) + 0.3 * rough)


def _courses(
    across: Field, along: Field, wide: float, tall: float, bond: float
) -> tuple[Field, NDArray[np.intp]]:
    """Return the distance in mm to the rim of each sample's brick, and the brick's number from 0.

    Coordinates are in bricks; each course is shifted by ``bond`` bricks against the one below.
    """
    row = np.floor(along)
    across = across + bond * row
    column = np.floor(across)
    du, dv = across - column, along - row
    inside = np.minimum(np.minimum(du, 1 - du) * wide, np.minimum(dv, 1 - dv) * tall)
    bricks = np.stack([column.ravel(), row.ravel()], axis=-1)
    number = np.unique(bricks, axis=0, return_inverse=True)[1]
    return inside, number.reshape(across.shape)
