"""Shapes at random places: bumps, dents, pores, broken gravel, river pebbles."""

import numpy as np

from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


def bumps(rng: np.random.Generator, grid: Grid) -> Field:
    """Bell-shaped bumps 0.6-3 mm apart at random places, of differing width and height, on flat ground."""
    spacing = basics.log_uniform(rng, 0.6, 3.0)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.1, 0.6))
    widths = spacing * rng.uniform(0.15, 0.4) * rng.uniform(0.6, 1.2, len(points))
    tall = rng.uniform(rng.uniform(0.1, 0.9), 1.0, len(points))
    near = basics.nearest(points, *basics.coordinates(grid), 6, grid.period())
    bells = tall[near.index] * np.exp(-((near.distance / widths[near.index]) ** 2) / 2)
    return basics.unit(bells.max(axis=-1))


def hammered(rng: np.random.Generator, grid: Grid) -> Field:
    """Shallow dents 0.8-3.5 mm apart that cut into one another, with crisp ridges between them."""
    spacing = basics.log_uniform(rng, 0.8, 3.5)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.2, 0.6))
    radius = spacing * rng.uniform(0.8, 1.25, len(points))
    depth = rng.uniform(0.0, 0.3, len(points))
    near = basics.nearest(points, *basics.coordinates(grid), 6, grid.period())
    dents = (near.distance / radius[near.index]) ** 2 - depth[near.index]
    return basics.unit(dents.min(axis=-1) + rng.uniform(0.0, 0.02) * basics.rough_noise(rng, grid, 2.0, 1.2))


def pores(rng: np.random.Generator, grid: Grid) -> Field:
    """Round pits of three sizes, 0.3-3 mm wide, the smaller the more of them, in a face that may be rough."""
    heights = rng.uniform(0.0, 0.06) * basics.rough_noise(rng, grid, 1.5, 1.2)
    widest = basics.log_uniform(rng, 1.0, 3.0)
    fill = rng.uniform(0.4, 0.95)
    for share in (1.0, 0.55, 0.3):
        width = widest * share
        points = basics.scattered(rng, grid, width * 1.5, 0.6)
        radius = width / 2 * rng.uniform(0.5, 1.2, len(points)) * (rng.random(len(points)) < fill)
        near = basics.nearest(points, *basics.coordinates(grid), 4, grid.period())
        pits = np.sqrt(np.maximum(radius[near.index] ** 2 - near.distance**2, 0.0))
        heights = np.minimum(heights, -pits.max(axis=-1) / widest)
    return basics.unit(heights)


_FACES = 6


def gravel(rng: np.random.Generator, grid: Grid) -> Field:
    """Angular stones 0.6-3 mm apart that lie on one another, each a lump of six faces and a flat top."""
    spacing = basics.log_uniform(rng, 0.6, 3.0)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.4, 0.6))
    count = len(points)
    radius = spacing * rng.uniform(0.5, 0.85, count)
    level = rng.uniform(0.0, 0.7, count)
    tilt = rng.normal(0.0, 0.25, (count, 2))
    first = rng.uniform(0, 2 * np.pi, count)
    near = basics.nearest(points, *basics.coordinates(grid), 6, grid.period())
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
    return basics.unit(highest + rng.uniform(0.005, 0.03) * basics.rough_noise(rng, grid, 1.0, 1.0))


def pebbles(rng: np.random.Generator, grid: Grid) -> Field:
    """Rounded stones 0.7-3.5 mm apart, each half an ellipsoid 1-2 times as long as wide, in a bed of sand."""
    spacing = basics.log_uniform(rng, 0.7, 3.5)
    points = basics.scattered(rng, grid, spacing, rng.uniform(0.3, 0.55))
    count = len(points)
    radius = spacing * rng.uniform(0.4, 0.6, count)
    longer = rng.uniform(1.0, rng.uniform(1.1, 2.0), count)
    angle = rng.uniform(0, np.pi, count)
    tall = rng.uniform(0.6, 1.0, count)
    near = basics.nearest(points, *basics.coordinates(grid), 6, grid.period())
    stones = near.index
    cos, sin = np.cos(angle)[stones], np.sin(angle)[stones]
    along = (cos * near.dx + sin * near.dy) / (radius * np.sqrt(longer))[stones]
    across = (cos * near.dy - sin * near.dx) / (radius / np.sqrt(longer))[stones]
    caps = tall[stones] * np.sqrt(np.maximum(1 - along**2 - across**2, 0.0))
    sand = rng.uniform(0.0, 0.3) + 0.03 * basics.rough_noise(rng, grid, 0.8, 1.0)
    return basics.unit(np.maximum(caps.max(axis=-1), sand))
