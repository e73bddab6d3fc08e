"""How noisy pictures differ, and how they change with heights, measured: what gradients are compared with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tests.visual.scenes import Array, waves

DIRECTIONS = (
    waves((1, 0), 0.0),
    waves((0, 1), 1.0),
    waves((2, 1), 2.0),
    waves((1, -2), 0.5),
    waves((3, 2), 0.0),
    waves((2, -3), 1.0),
)
"""Smooth changes of the heights, 1 mm high."""

ADJOINTS = (
    1.0 + waves((1, 1), -np.pi / 2),
    1.0 + waves((2, 0), 1.0 - np.pi / 2),
    1.0 + waves((0, 2), 2.0 - np.pi / 2),
)
"""Smooth weights of the pixels: each makes a number of a picture."""


def differ_by_noise(one: Sequence[Array], other: Sequence[Array]) -> bool:
    """Whether two sets of as many pictures, each with seeds of its own, have one mean but for their noise.

    True if the mean over the pixels of the square of Student's t is its expectation, or up to 20 % more.
    """
    seeds = len(one)
    assert len(other) == seeds
    rounding = 1e-5 * np.mean(one)
    variance = (np.var(one, axis=0, ddof=1) + np.var(other, axis=0, ddof=1)) / seeds + rounding**2
    squares = (np.mean(one, axis=0) - np.mean(other, axis=0)) ** 2 / variance
    freedom = seeds - 1
    return bool(squares.mean() < 1.2 * freedom / (freedom - 2))


Picture = Callable[[Array, int], Array]
"""A picture (rows, cols) of heights (rows, cols) with a seed."""


@dataclass(frozen=True)
class Slopes:
    """Slopes of the weighted pictures: mean (directions, adjoints), and its standard error relative to it."""

    mean: Array
    standard_error: float

    def error(self, other: Array) -> float:
        """Distance of other slopes from these, relative to the size of these."""
        return float(np.linalg.norm(other - self.mean) / np.linalg.norm(self.mean))


def _over_seeds(found: Sequence[Array]) -> Slopes:
    mean = np.mean(found, axis=0)
    scatter = np.std(found, axis=0, ddof=1) / np.sqrt(len(found))
    return Slopes(mean, float(np.linalg.norm(scatter) / np.linalg.norm(mean)))


def measured(picture: Picture, heights: Array, step_mm: float, seeds: int) -> Slopes:
    """Central differences with common random numbers."""

    def numbers(at: Array, seed: int) -> Array:
        shot = picture(at, seed)
        return np.array([(weights * shot).sum() for weights in ADJOINTS])

    def slopes(seed: int) -> Array:
        return np.array(
            [
                (numbers(heights + step_mm * d, seed) - numbers(heights - step_mm * d, seed)) / (2 * step_mm)
                for d in DIRECTIONS
            ]
        )

    return _over_seeds([slopes(seed) for seed in range(seeds)])


def by_gradients(gradient: Callable[[Array, int], Array], seeds: int) -> Slopes:
    """The same from gradients (rows, cols) of an adjoint picture with a seed."""
    return _over_seeds(
        [
            np.array(
                [
                    [(found * d).sum() for found in gradients]
                    for gradients in [[gradient(weights, seed) for weights in ADJOINTS]]
                    for d in DIRECTIONS
                ]
            )
            for seed in range(seeds)
        ]
    )
