"""Straight ribs and crossed ribs: corduroy, combed plaster, knurled metal, waffles."""

from collections.abc import Callable

import numpy as np

from relief.ground.arrays import smooth_step
from surrogate.families import basics
from surrogate.families.basics import Field
from surrogate.families.texture_grid import Grid


def _ribs(rng: np.random.Generator) -> Callable[[Field], Field]:
    """A profile over one period: from a place in [0, 1) to a height in [0, 1], continuous around."""
    duty = rng.uniform(0.3, 0.7)
    edge = rng.uniform(0.12, 0.25)
    peak = rng.uniform(0.1, 0.9)
    sharpness = basics.log_uniform(rng, 0.5, 4.0)
    profiles: list[Callable[[Field], Field]] = [
        lambda t: 0.5 + 0.5 * np.cos(2 * np.pi * t),
        lambda t: (0.5 + 0.5 * np.cos(2 * np.pi * t)) ** sharpness,
        lambda t: np.where(t < peak, t / peak, (1 - t) / (1 - peak)),
        lambda t: smooth_step((duty / 2 - np.abs(t - 0.5)) / edge + 0.5),
        lambda t: basics.dome((t - 0.5) / max(duty, 0.45)),
    ]
    return profiles[rng.integers(len(profiles))]


def grating(rng: np.random.Generator, grid: Grid) -> Field:
    """Ribs of period 0.6-5 mm in any direction: sinusoidal, sharp, triangular, flat-topped or round.

    Some wander by up to a third of a period.
    """
    period = basics.log_uniform(rng, 0.6, 5.0)
    across, _ = basics.lattice(grid, basics.any_direction(rng), period, period)
    place = across / period + rng.random()
    if rng.random() < 0.4:
        place = place + rng.uniform(0.05, 0.3) * basics.smooth_noise(rng, grid, rng.uniform(1.0, 2.5))
    return basics.unit(_ribs(rng)(place % 1.0))


def crossed(rng: np.random.Generator, grid: Grid) -> Field:
    """Two gratings of period 0.6-3 mm, 60-90 degrees apart: pyramids, waffles, knurls, studs."""
    angle = basics.any_direction(rng)
    period = basics.log_uniform(rng, 0.6, 3.0)
    second_period = period if rng.random() < 0.6 else basics.log_uniform(rng, 0.6, 3.0)
    second_angle = angle + (np.pi / 2 if rng.random() < 0.6 else rng.uniform(np.pi / 3, np.pi / 2))
    profile = _ribs(rng)
    first = profile((basics.lattice(grid, angle, period, period)[0] / period + rng.random()) % 1.0)
    across, _ = basics.lattice(grid, second_angle, second_period, second_period)
    second = profile((across / second_period + rng.random()) % 1.0)
    together = [np.minimum(first, second), np.maximum(first, second), first * second, first + second]
    return basics.unit(together[rng.integers(len(together))])
