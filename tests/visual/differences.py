"""How noisy pictures differ, and how they change with heights, measured: what gradients are compared with."""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np
import torch

from tests.recorded import Truth, Truths, files_of, over_seeds
from tests.visual.scenes import SIDE, Array, waves
from visual.scene import Scene

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


def slopes_of_pictures(
    truths: Truths,
    scene: Scene,
    step_mm: float,
    seeds: int,
    samples: int,
    *,
    pixels: Array | None = None,
    tile: bool = False,
) -> Truth:
    """Recorded slopes (directions, adjoints) of a scene's weighted first picture, by central differences.

    Both ends of a difference have the same random numbers.

    Args:
        truths: the records of the test.
        scene: as it was loaded; slopes are taken at its own heights.
        step_mm: change of the heights to either side.
        seeds: number of estimates, whose scatter gives the standard error.
        samples: of each pixel.
        pixels: further weights of the pixels (rows, cols); default 1.
        tile: whether the plate repeats, which the scene's files do not say.
    """
    inputs = {
        "scene": files_of(scene),
        "settings": [step_mm, seeds, samples],
        "weights": [DIRECTIONS, ADJOINTS, 1.0 if pixels is None else pixels],
    } | ({"tile": "both ways"} if tile else {})
    return truths(inputs, lambda: _central_differences(scene, step_mm, seeds, samples, pixels))


def pictures_of_mitsuba(
    truths: Truths, scene: Scene, samples: int, seeds: int = 2, tile: bool = False
) -> Truth:
    """Recorded pictures (conditions, rows, cols) of a scene's own heights by Mitsuba: their mean over seeds.

    For tests of other looks; arguments are those of `slopes_of_pictures`.
    """

    def rendered() -> Truth:
        return over_seeds([scene.render(samples=samples, seed=seed).numpy() for seed in range(seeds)])

    return truths([files_of(scene), samples, seeds] + (["a tile both ways"] if tile else []), rendered)


def _central_differences(
    scene: Scene, step_mm: float, seeds: int, samples: int, pixels: Array | None
) -> Truth:
    heights = np.asarray(scene.heights)

    def numbers(at: Array, seed: int) -> Array:
        picture = scene.render(at, samples=samples, seed=seed).numpy()[0]
        seen = picture if pixels is None else pixels * picture
        return np.array([(weights * seen).sum() for weights in ADJOINTS])

    def slopes(seed: int) -> list[Array]:
        ends = [[numbers(heights + sign * step_mm * d, seed) for sign in (1, -1)] for d in DIRECTIONS]
        return [(up - down) / (2 * step_mm) for up, down in ends]

    return over_seeds([slopes(seed) for seed in range(seeds)])


Gradient = Callable[[Array, int], Array]
"""Gradient (rows, cols) by the heights of a picture weighted by an array (rows, cols), with a seed."""


def rendered_gradient(scene: Scene, samples: int | None = None, shadow_edges: bool = True) -> Gradient:
    """The gradient of a scene's first picture through `Scene.render`."""

    def gradient(weights: Array, seed: int) -> Array:
        heights = torch.tensor(scene.heights, requires_grad=True)
        pictures = scene.render(heights, samples=samples, seed=seed, shadow_edges=shadow_edges)
        (pictures[0] * torch.as_tensor(weights)).sum().backward()
        assert heights.grad is not None
        return heights.grad.numpy()

    return gradient


def view_gradient(scene: Scene, edges: bool = True) -> Gradient:
    """The gradient of a scene's first picture by the explicit Jacobian of a view that the seed makes."""
    return jacobian_gradient(
        lambda seed: scene.views(seed=seed)[0].evaluate(scene.heights, edges=edges).jacobians[0]
    )


def jacobian_gradient(jacobian: Callable[[int], Any]) -> Gradient:
    """The gradient by a Jacobian (pixels, heights) that the seed makes."""
    known = cache(jacobian)

    def gradient(weights: Array, seed: int) -> Array:
        return np.asarray(known(seed).T @ weights.ravel()).reshape(SIDE, SIDE)

    return gradient


def by_gradients(gradient: Gradient, seeds: int) -> Truth:
    """Slopes (directions, adjoints) from gradients."""

    def slopes(seed: int) -> list[list[float]]:
        gradients = [gradient(weights, seed) for weights in ADJOINTS]
        return [[(found * direction).sum() for found in gradients] for direction in DIRECTIONS]

    return over_seeds([slopes(seed) for seed in range(seeds)])
