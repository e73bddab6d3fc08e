"""Woven cloth: plain, basket, twill and satin."""

import numpy as np
from numpy.typing import NDArray

from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid

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
