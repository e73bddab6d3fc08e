"""Pictures of two reliefs, rendered until the change between them is known.

Light is linear, so that each light is rendered alone and takes as many samples as its own noise asks for.
Both reliefs share their random numbers, so that most of the noise cancels in the change.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from relief.arrays import Array
from relief.progress import stage
from visual.exact.light_scene import LightScene
from visual.exact.render import RenderSettings, condition_pictures, light_pictures
from visual.noise import BATCHES, Batches
from visual.scene import Scene

LEAST_SAMPLES, MOST_SAMPLES = 64, 256
"""Samples a pixel of the first pictures, and most; docs/decisions.md has the error of a change by samples."""
WORTH = 0.5
"""Share of the largest gain from which on a light gets more samples. The gain is the variance of a light's
part of the change over its samples: the fall of the variance by one sample more, up to a factor."""

Known = Callable[[Batches, Batches], bool]
"""Whether the change between pictures is known, from the pictures before and after."""


def converged(
    scene: Scene, before: Array, after: Array, known: Known, seed: int = 0, most: int = MOST_SAMPLES
) -> tuple[Batches, Batches]:
    """Render two reliefs until the change of their pictures is known, or each light has its most samples.

    Args:
        scene: renders the pictures.
        before, after: (rows, cols) mm.
        known: asked after each round.
        seed: of the random numbers.
        most: samples a pixel of each light.

    Returns:
        Pictures before and after; batch n of both has the same random numbers. Their number of samples is
        that of the light with fewest.
    """
    suns = len(scene.lit_scenes()[0])
    reliefs = before, after
    lights = [_Part(light, number, seed, reliefs) for number, light in enumerate(scene.light_scenes())]
    with stage("rendering", 2 * BATCHES * len(lights)) as advance:
        for light in lights:
            light.render(LEAST_SAMPLES, advance)
    while True:
        pair = _pictures(lights, suns, 0), _pictures(lights, suns, 1)
        growing = [light for light in lights if 2 * light.samples <= most]
        if not growing or known(*pair):
            return pair
        # Each sun lights one of the conditions, ambient light lights them all.
        shares = [1.0 / suns if light.number < suns else 1.0 for light in growing]
        gains = [share * light.variance / light.samples for share, light in zip(shares, growing, strict=True)]
        noisy = [light for light, gain in zip(growing, gains, strict=True) if gain >= WORTH * max(gains)]
        with stage("rendering with more samples", 2 * BATCHES * len(noisy)) as advance:
            for light in noisy:
                light.render(light.samples, advance)


def colour_pictures(scene: Scene, before: Array, after: Array, seed: int = 0) -> tuple[Array, Array]:
    """Pictures of two reliefs in linear RGB, each (conditions, rows, cols, 3), to be looked at.

    Args:
        scene: has colour.
        before, after: (rows, cols) mm.
        seed: of the random numbers, the same for both.
    """
    with stage("rendering in colour", 2) as advance:
        pictures = []
        for relief in (before, after):
            pictures.append(np.moveaxis(scene.render_colour(relief, LEAST_SAMPLES, seed), 0, -1))
            advance()
    return pictures[0], pictures[1]


@dataclass
class _Part:
    """Pictures of two reliefs under one light.

    Attributes:
        light: renders the pictures.
        number: of the light.
        seed: of the random numbers.
        reliefs: before and after.
        samples: a pixel so far, of all batches together.
        pictures: (2, batches, cameras, rows, cols) means of all samples so far.
    """

    light: LightScene
    number: int
    seed: int
    reliefs: tuple[Array, Array]
    samples: int = 0
    pictures: Array | None = None

    @property
    def variance(self) -> float:
        """Variance of the mean change, averaged over the pixels."""
        assert self.pictures is not None
        change = self.pictures[1] - self.pictures[0]
        return float(change.var(axis=0, ddof=1).mean()) / len(change)

    def render(self, samples: int, advance: Callable[[], None]) -> None:
        """Add samples, evenly over the batches, with random numbers of their own.

        Args:
            samples: a pixel, of all batches together.
            advance: called after each of the 2 x batches pictures.
        """
        seeds = np.random.SeedSequence((self.seed, self.samples)).generate_state(BATCHES)
        each = [RenderSettings(samples // BATCHES, int(seed), shadow_edges=False) for seed in seeds]
        # The relief that the light scene holds goes first: another relief takes as long as some samples.
        new: dict[int, list[Array]] = {}
        for relief in (0, 1) if self.pictures is None else (1, 0):
            new[relief] = []
            for settings in each:
                new[relief].append(light_pictures(self.light, self.reliefs[relief], settings, self.number))
                advance()
        added, total = np.array([new[0], new[1]]), self.samples + samples
        if self.pictures is not None:
            added = (self.samples * self.pictures + samples * added) / total
        self.pictures, self.samples = added, total


def _pictures(lights: Sequence[_Part], suns: int, relief: int) -> Batches:
    each = [light.pictures[relief] for light in lights if light.pictures is not None]
    ambient = each[suns] if len(each) > suns else None
    return Batches(condition_pictures(each[:suns], ambient), min(light.samples for light in lights))
