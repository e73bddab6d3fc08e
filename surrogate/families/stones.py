"""Loose stones: broken gravel and river pebbles."""

import numpy as np

from surrogate.families.basics import Field, coordinates, log_uniform, nearest, rough_noise, scattered, unit
from surrogate.families.texture_grid import Grid

_FACES = 6


def gravel(rng: np.random.Generator, grid: Grid) -> Field:
    """Angular stones 0.6-3 mm apart that lie on one another, each a lump of six faces and a flat top."""
    spacing = log_uniform(rng, 0.6, 3.0)
    points = scattered(rng, grid, spacing, rng.uniform(0.4, 0.6))
    count = len(points)
    radius = spacing * rng.uniform(0.5, 0.85, count)
    level = rng.uniform(0.0, 0.7, count)
    tilt = rng.normal(0.0, 0.25, (count, 2))
    first = rng.uniform(0, 2 * np.pi, count)
    near = nearest(points, *coordinates(grid), 6, grid.period())
    stones = near.index
    u, v = near.dx / radius[stones], near.dy / radius[stones]
    outline = np.zeros_like(u)
    for face in range(_FACES):
        angle = first + (face + rng.uniform(-0.3, 0.3, count)) * (2 * np.pi / _FACES)
        far = rng.uniform(0.75, 1.1, count)
        outline = np.maximum(outline, ((np.cos(angle) / far)[stones] * u + (np.sin(angle) / far)[stones] * v))
    top = level[stones] + tilt[stones, 0] * u + tilt[stones, 1] * v
    # A face falls from the rim of the top, at 0.6 of the outline, ever more steeply.
    lumps = top - 2.5 * np.maximum(outline - 0.6, 0.0) ** 1.5
    highest = np.maximum(lumps.max(axis=-1), -0.5)
    return unit(highest + rng.uniform(0.005, 0.03) * rough_noise(rng, grid, 1.0, 1.0))


def pebbles(rng: np.random.Generator, grid: Grid) -> Field:
    """Rounded stones 0.7-3.5 mm apart, each half an ellipsoid 1-2 times as long as wide, in a bed of sand."""
    spacing = log_uniform(rng, 0.7, 3.5)
    points = scattered(rng, grid, spacing, rng.uniform(0.3, 0.55))
    count = len(points)
    radius = spacing * rng.uniform(0.4, 0.6, count)
    longer = rng.uniform(1.0, rng.uniform(1.1, 2.0), count)
    angle = rng.uniform(0, np.pi, count)
    tall = rng.uniform(0.6, 1.0, count)
    near = nearest(points, *coordinates(grid), 6, grid.period())
    stones = near.index
    cos, sin = np.cos(angle)[stones], np.sin(angle)[stones]
    along = (cos * near.dx + sin * near.dy) / (radius * np.sqrt(longer))[stones]
    across = (cos * near.dy - sin * near.dx) / (radius / np.sqrt(longer))[stones]
    caps = tall[stones] * np.sqrt(np.maximum(1 - along**2 - across**2, 0.0))
    sand = rng.uniform(0.0, 0.3) + 0.03 * rough_noise(rng, grid, 0.8, 1.0)
    return unit(np.maximum(caps.max(axis=-1), sand))
