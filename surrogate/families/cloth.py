"""Cloth: knitted, woven, and strands laid over one another."""

import numpy as np
from numpy.typing import NDArray

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


_REPEATS = {"plain": (2, 2), "basket": (4, 4), "twill": (4, 4), "broken twill": (4, 8), "satin": (5, 5)}
"""Yarns along and across after which a binding repeats."""
_BINDINGS = tuple(_REPEATS)


def weave(rng: np.random.Generator, grid: Grid) -> Field:
    """Round yarns 0.6-2.4 mm apart, one set across the other, over and under as the binding says.

    The cloth is turned, its yarns wander a little and are twisted of fibres.
    """
    across_mm = basics.log_uniform(rng, 0.6, 2.4)
    along_mm = across_mm * rng.uniform(0.7, 1.4)
    binding = _BINDINGS[rng.integers(len(_BINDINGS))]
    width = rng.uniform(0.8, 1.0)
    crimp = rng.uniform(0.4, 1.0)
    twist = rng.uniform(0.0, 0.12)
    u, v = basics.lattice(grid, basics.any_direction(rng), across_mm, along_mm, _REPEATS[binding])
    u = u / across_mm + rng.uniform(0.02, 0.08) * basics.smooth_noise(rng, grid, 1.0) + rng.random()
    v = v / along_mm + rng.uniform(0.02, 0.08) * basics.smooth_noise(rng, grid, 1.0) + rng.random()
    warp = _yarn(u, v, binding, width, crimp, twist, 1.0)
    weft = _yarn(v, u, binding, width, crimp, twist, -1.0)
    return basics.unit(np.maximum(np.maximum(warp, weft), -crimp))


def _yarn(
    across: Field, along: Field, binding: str, width: float, crimp: float, twist: float, side: float
) -> Field:
    """Height of one set of yarns, in yarn radii; ``side`` is 1 for those that are up where the binding is."""
    column, row = np.floor(across).astype(int), np.floor(along).astype(int)
    place = along - row - 0.5
    neighbour = row + np.where(place < 0, -1, 1)

    def up(of_row: NDArray[np.int_]) -> Field:
        warp, weft = (column, of_row) if side > 0 else (of_row, column)
        return side * np.where(_is_up(warp, weft, binding), 1.0, -1.0)

    blend = 0.5 * (1 - np.cos(np.pi * np.abs(place)))
    level = crimp * (up(row) * (1 - blend) + up(neighbour) * blend)
    offset = (across - column - 0.5) * 2 / width
    fibres = twist * np.cos(2 * np.pi * (offset * 1.5 + along * 2.5))
    return np.where(np.abs(offset) < 1, level + basics.dome(offset) + fibres * basics.dome(offset), -np.inf)


def _is_up(column: NDArray[np.int_], row: NDArray[np.int_], binding: str) -> NDArray[np.bool_]:
    """Where the warp lies above the weft."""
    if binding == "plain":
        return (column + row) % 2 == 0
    if binding == "basket":
        return (column // 2 + row // 2) % 2 == 0
    if binding == "twill":
        return (column + row) % 4 < 2
    if binding == "broken twill":
        return (np.where(row % 8 < 4, column + row, column - row - 1)) % 4 < 2
    return (2 * column + row) % 5 != 0


def fibres(rng: np.random.Generator, grid: Grid) -> Field:
    """40-160 bent strands a plate, 0.3-1 mm thick at random depths, in every direction or combed into one."""
    x, y = basics.coordinates(grid)
    thick = basics.log_uniform(rng, 0.3, 1.0)
    count = int(np.clip(rng.uniform(40, 70) / thick, 40, 160) * grid.plates)
    main, spread = basics.any_direction(rng), rng.choice([0.4, np.pi])
    depth = rng.uniform(1.0, 3.0)
    heights = np.full_like(x, -depth)
    for _ in range(count):
        along, across = basics.turned(x, y, main + spread * rng.uniform(-0.5, 0.5))
        start, side = rng.uniform(-0.6, 0.6, 2) * grid.side_mm
        bend, wave, pace = rng.normal(0.0, 0.03), rng.normal(0.0, 0.15), rng.uniform(0.5, 1.5)
        radius = thick / 2 * rng.uniform(0.7, 1.2)
        level = -depth * rng.random()
        along = along - start
        offset = (across - side - bend * along**2 - wave * np.sin(pace * along)) / radius
        strand = level + basics.dome(offset)
        heights = np.where((np.abs(offset) < 1) & (strand > heights), strand, heights)
    return basics.unit(heights)
