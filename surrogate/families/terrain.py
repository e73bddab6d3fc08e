"""Eroded ground: mountains with valleys cut by water."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from surrogate.families.basics import Field, log_uniform, rough_noise, unit
from surrogate.families.texture_grid import Grid

_ROUNDS = 10
_NEIGHBOURS = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if (i, j) != (0, 0))


def terrain(rng: np.random.Generator, grid: Grid) -> Field:
    """Hills 4-10 mm wide under running water, with valleys that branch down to the size of a sample.

    The law of stream power (K. X. Whipple and G. E. Tucker, J. Geophys. Res. 104, 1999): a place wears as its
    slope times the square root of the area that drains through it; then slopes creep.
    """
    ground = unit(rough_noise(rng, grid, log_uniform(rng, 4.0, 10.0), rng.uniform(2.2, 2.8)))
    strength = rng.uniform(0.06, 0.2)
    creep = rng.uniform(0.02, 0.1)
    for _ in range(_ROUNDS):
        target, drop = _downhill(ground, grid.periodic)
        ground = ground - np.minimum(strength * np.sqrt(_drained(target)) * drop, 0.8 * drop)
        ground = ground + creep * _spread(ground, grid.periodic)
    return unit(ground)


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
