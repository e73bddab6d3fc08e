"""Noise of pictures: means and standard errors from independent batches.

A picture is rendered as several pictures of fewer samples, each with random numbers of its own. The spread of
these pictures gives the noise of their mean. The spread of the samples within one picture does not, because a
stratified sampler makes samples depend on one another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array
from relief.ground.progress import stage
from visual.lights.parallel import LUMINANCE

if TYPE_CHECKING:
    from torch import Tensor

    from visual.scene import Scene


BATCHES = 4
"""Number of batches. More batches estimate the noise better but enlarge it: a batch has fewer strata."""


@dataclass(frozen=True)
class Batches:
    """Pictures of one relief, rendered several times.

    Attributes:
        pictures: (batches, conditions, rows, cols) radiance.
        samples: a pixel, of all batches together.
        first: the same by the first `first_samples` alone; None where all came at once.
        first_samples: a pixel, of all batches together.
    """

    pictures: Array
    samples: int
    first: Array | None = None
    first_samples: int = 0

    @property
    def mean(self) -> Array:
        """(conditions, rows, cols) radiance."""
        return np.asarray(self.pictures.mean(axis=0))

    @property
    def standard_error(self) -> Array:
        """(conditions, rows, cols) standard error of `mean`, radiance."""
        return np.asarray(self.pictures.std(axis=0, ddof=1) / np.sqrt(len(self.pictures)))

    def relative_error(self, weights: Array | float = 1.0) -> Array:
        """(conditions,) root mean square of the standard error over the pixels, by the mean radiance.

        0 for a black picture.

        Args:
            weights: (conditions, rows, cols) of the pixels, with mean 1 over each picture.
        """
        error = np.sqrt((weights * np.square(self.standard_error)).mean(axis=(1, 2)))
        level = (weights * self.mean).mean(axis=(1, 2))
        return np.divide(error, level, out=np.zeros_like(error), where=level > 0.0)

    def condition(self, number: int) -> Batches:
        """The batches of one condition alone."""
        return replace(self, pictures=self.pictures[:, number : number + 1])


def batched(
    scene: Scene,
    heights: Tensor | ArrayLike | None = None,
    samples: int | None = None,
    seed: int = 0,
    resolution: int | None = None,
) -> Batches:
    """Render a relief in batches.

    Args:
        scene: renders the pictures.
        heights: (rows, cols) mm; default the scene's own.
        samples: a pixel, of all batches together, at least one in each; default as the scene file says.
        seed: the same seed, the same random numbers in each batch, whatever the relief.
        resolution: pixels along the film's longer side instead of its own.

    Raises:
        InputError: as `Scene.render`.
    """
    each = -(-(samples or scene.samples) // BATCHES)
    seeds = np.random.SeedSequence(seed).generate_state(BATCHES)
    pictures = []
    with stage("rendering", BATCHES) as advance:
        for s in seeds:
            rendered = scene.render(heights, samples=each, seed=int(s), resolution=resolution)
            pictures.append(rendered.detach().numpy())
            advance()
    return Batches(np.array(pictures, dtype=np.float64), each * BATCHES)


def batched_colour(scene: Scene, samples: int | None = None, seed: int = 0) -> tuple[Batches, Array]:
    """Batches of a scene's own relief, and the mean pictures in colour, (conditions, rows, cols, 3)."""
    each = -(-(samples or scene.samples) // BATCHES)
    seeds = np.random.SeedSequence(seed).generate_state(BATCHES)
    colours = np.array([scene.render_colour(samples=each, seed=int(s)) for s in seeds])
    grey = Batches(np.tensordot(colours, LUMINANCE, (1, 0)), each * BATCHES)
    return grey, np.moveaxis(colours.mean(axis=0), 0, -1)


def jackknife_error(statistic: Callable[..., float], *batched: Array) -> float:
    """Standard error of a statistic of batches, by leaving out one batch after another.

    For U-statistics the estimate is too large on average, never too small (Efron and Stein, "The jackknife
    estimate of variance", 1981). Its own relative error is about 1 / sqrt(2 (batches - 1)): 40 % with four.

    Args:
        statistic: a function of arrays like `batched`, for any number of batches.
        batched: arrays (batches, ...); batches of one number belong together.
    """
    count = len(batched[0])
    left = [statistic(*(np.delete(array, out, axis=0) for array in batched)) for out in range(count)]
    return float(np.sqrt((count - 1) * np.var(left)))
