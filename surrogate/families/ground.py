"""Ground: eroded by water, stepped into terraces, and cut into blocks."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import smooth_step
from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid

_ROUNDS = 10
_NEIGHBOURS = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))


def terrain(rng: np.random.Generator, grid: Grid) -> Field:
    """Hills 4-10 mm wide under running water, with valleys that branch down to the size of a sample.

    The law of stream power (K. X. Whipple and G. E. Tucker, J. Geophys. Res. 104, 1999): a place wears as its
    slope times the square root of the area that drains through it; then slopes creep.
    """
    ground = basics.unit(
        basics.rough_noise(rng, grid, basics.log_uniform(rng, 4.0, 10.0), rng.uniform(2.2, 2.8))
    )
    strength = rng.uniform(0.06, 0.2)
    creep = rng.uniform(0.02, 0.1)
    for _ in range(_ROUNDS):
        target, drop = _downhill(ground, grid.periodic)
        ground = ground - np.minimum(strength * np.sqrt(_drained(target)) * drop, 0.8 * drop)
        ground = ground + creep * _spread(ground, grid.periodic)
    return basics.unit(ground)


def _downhill(ground: Field, periodic: bool) -> tuple[NDArray[np.intp], Field]:
    """Return the number of each sample's steepest lower neighbour (in a pit, its own), and the drop to it."""
    rows, cols = ground.shape
    beyond: Literal["edge", "wrap"] = "wrap" if periodic else "edge"
    padded = np.pad(ground, 1, mode=beyond)
    numbers = np.pad(np.arange(rows * cols).reshape(rows, cols), 1, mode=beyond)
    target = numbers[1:-1, 1:-1].copy()
    drop, steepest = np.zeros_like(ground), np.zeros_like(ground)
    for i, j in _NEIGHBOURS:
        window = np.s_[1 + i : 1 + i + rows, 1 + j : 1 + j + cols]
        fall = ground - padded[window]
        slope = fall / np.hypot(i, j)
        better = slope > steepest
        steepest[better], drop[better] = slope[better], fall[better]
        target[better] = numbers[window][better]
    return target, drop


def _drained(target: NDArray[np.intp]) -> Field:
    """Count the samples that drain through each, itself included; a round doubles the length of the paths."""
    flow = np.ones(target.size)
    place = np.arange(target.size)
    ends = target.ravel() == place
    # A pit must not pass its flow on to itself: one more place takes the flow and is dropped.
    onward = np.append(np.where(ends, target.size, target.ravel()), target.size)
    flow = np.append(flow, 0.0)
    while (onward[:-1] != target.size).any():
        flow[:-1] += np.bincount(onward[:-1], flow[:-1], target.size + 1)[:-1]
        onward = onward[onward]
    return flow[:-1].reshape(target.shape)


def _spread(ground: Field, periodic: bool) -> Field:
    """Return the sum of the differences to the four neighbours; nothing crosses the rim of a plate."""
    beyond: Literal["edge", "wrap"] = "wrap" if periodic else "edge"
    padded = np.pad(ground, 1, mode=beyond)
    around = padded[:-2, 1:-1] + padded[2:, 1:-1] + padded[1:-1, :-2] + padded[1:-1, 2:]
    return around - 4 * ground


def terraces(rng: np.random.Generator, grid: Grid) -> Field:
    """3 to 9 terraces cut into rolling ground, a slope or a cone; edges 0.08-0.3 of a terrace wide."""
    levels = int(rng.integers(3, 10))
    x, y = basics.coordinates(grid)
    # On a tile, what goes up comes down again.
    right, up = (np.abs(x), np.abs(y)) if grid.periodic else (x, y)
    grounds = [
        basics.smooth_noise(rng, grid, rng.uniform(0.7, 1.8)),
        basics.turned(right, up, rng.uniform(0, np.pi))[0] / 2
        + rng.uniform(0, 0.6) * basics.smooth_noise(rng, grid, 1.0),
        np.hypot(grid.offset(x - rng.uniform(-4, 4)), grid.offset(y - rng.uniform(-4, 4))) / 2
        + 0.3 * basics.smooth_noise(rng, grid, 1.0),
        basics.rough_noise(rng, grid, rng.uniform(3.0, 6.0), 2.2),
    ]
    ground = basics.unit(grounds[rng.integers(len(grounds))]) * levels
    edge = rng.uniform(0.08, 0.3)
    floor = np.floor(ground)
    stepped = floor + smooth_step((ground - floor - 1 + edge) / edge)
    return basics.unit(stepped + rng.uniform(0.0, 0.25) * ground)


def blocks(rng: np.random.Generator, grid: Grid) -> Field:
    """Upright blocks of 0.5-5 mm: the plate is cut in two again and again, each part at its own height."""
    smallest = basics.log_uniform(rng, 0.5, 2.0)
    edge = 0.12
    u, v = basics.turned(*basics.coordinates(grid), grid.direction(basics.any_direction(rng)))
    heights = np.zeros_like(u)
    reach = grid.side_mm / 2 if grid.periodic else grid.side_mm / np.sqrt(2)
    parts = [(-reach, reach, -reach, reach)]
    while parts:
        left, right, bottom, top = parts.pop()
        wide, tall = right - left, top - bottom
        longer = max(wide, tall)
        if longer > 5.0 or (longer > 2 * smallest and rng.random() < 0.85):
            share = rng.uniform(0.35, 0.65)
            if wide > tall:
                cut = left + share * wide
                parts += [(left, cut, bottom, top), (cut, right, bottom, top)]
            else:
                cut = bottom + share * tall
                parts += [(left, right, bottom, cut), (left, right, cut, top)]
            continue
        if grid.periodic:
            across, along = grid.offset(u - (left + right) / 2), grid.offset(v - (bottom + top) / 2)
            inside = np.minimum(wide / 2 - np.abs(across), tall / 2 - np.abs(along))
        else:
            inside = np.minimum(np.minimum(u - left, right - u), np.minimum(v - bottom, top - v))
        heights += rng.random() * smooth_step(inside / edge + 0.5)
    return basics.unit(heights)
