"""Knitted cloth in stocking stitch."""

import numpy as np

from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


def knit(rng: np.random.Generator, grid: Grid) -> Field:
    """Columns of V-shaped stitches 1.2-3.5 mm wide, each leg a twisted strand that dips at both ends."""
    wide = basics.log_uniform(rng, 1.2, 3.5)
    tall = wide * rng.uniform(0.65, 0.9)
    thick = rng.uniform(0.17, 0.21)
    twist = rng.uniform(0.0, 0.15)
    u, v = basics.lattice(grid, basics.any_direction(rng), wide, tall)
    u = u / wide + rng.uniform(0.01, 0.05) * basics.smooth_noise(rng, grid, 1.2) + rng.random()
    v = v / tall + rng.uniform(0.01, 0.05) * basics.smooth_noise(rng, grid, 1.2) + rng.random()
    column = np.abs(u - np.floor(u) - 0.5)
    row = v - np.floor(v)
    heights = np.zeros_like(u)
    for shift in (-1, 0, 1):
        heights = np.maximum(heights, _leg(column, row + shift, thick, twist))
    return basics.unit(heights)


def _leg(across: Field, along: Field, thick: float, twist: float) -> Field:
    """Height of the strand from foot (0.05, -0.3) to shoulder (0.37, 0.75) of a stitch one unit tall."""
    foot, reach = (0.05, -0.3), (0.32, 1.05)
    length = np.hypot(*reach)
    dx, dy = across - foot[0], along - foot[1]
    place = np.clip((dx * reach[0] + dy * reach[1]) / length**2, 0.0, 1.0)
    offset = np.hypot(dx - place * reach[0], dy - place * reach[1]) / thick
    side = (dx * reach[1] - dy * reach[0]) / (length * thick)
    fibres = 1 + twist * np.cos(2 * np.pi * (side * 0.8 + place * 5))
    lie = 0.5 + 0.5 * np.sin(np.pi * place)
    return basics.dome(offset) * fibres * (0.2 + 0.8 * lie)
