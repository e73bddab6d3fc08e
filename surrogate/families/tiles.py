"""Tiles and bricks with joints between them."""

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import smooth_step
from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


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
