"""Pictures of two reliefs, rendered until the change between them is known.

Light is linear, so that each light is rendered alone and takes as many samples as its own noise asks for.
Both reliefs share their random numbers, so that most of the noise cancels in the change.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from relief.ground.arrays import Array
from relief.ground.progress import stage
from visual.exact.light_scene import LightScene
from visual.exact.render import RenderSettings, condition_pictures, light_pictures
from visual.picture_noise import BATCHES, Batches
from visual.scene import Scene

LEAST_SAMPLES, MOST_SAMPLES = 64, 256
"""Samples a pixel of the first pictures, and most; docs/evidence/speed.md has the error by samples."""
WORTH = 0.5
"""Share of the largest gain from which on a light gets more samples. The gain is the variance of a light's
part of the change over its samples: the fall of the variance by one sample more, up to a factor."""

Known = Callable[[Batches, Batches], bool]
"""Whether the change between pictures is known, from the pictures before and after."""


def converged(
    scene: Scene,
    before: Array,
    after: Array,
    known: Known,
    seed: int = 0,
    most: int = MOST_SAMPLES,
    least: int = LEAST_SAMPLES,
) -> tuple[Batches, Batches]:
    """Render two reliefs until the change of their pictures is known, or each light has its most samples.

    Args:
        scene: renders the pictures.
        before, after: (rows, cols) mm.
        known: asked after each round.
        seed: of the random numbers.
        most: samples a pixel of each light.
        least: samples a pixel of the first pictures.

    Returns:
        Pictures before and after; batch n of both has the same random numbers. Their number of samples is
        that of the light with fewest.
    """
    suns = len(scene.lit_scenes()[0])
    lights = [_LightPictures(light, number, seed) for number, light in enumerate(scene.light_scenes())]
    # The relief that the scene holds goes first, and all lights of one relief together: a new relief takes as
    # long as a picture.
    reliefs: list[tuple[int, Array]] = [(0, scene.levelled(before)), (1, scene.levelled(after))]
    least = BATCHES * -(-least // BATCHES)
    _render(lights, reliefs, [least] * len(lights), "rendering")
    first = _pictures(lights, suns, 0).pictures
    while True:
        pair = (
            replace(_pictures(lights, suns, 0), first=first, first_samples=least),
            _pictures(lights, suns, 1),
        )
        growing = [light for light in lights if 2 * light.samples <= most]
        if not growing or known(*pair):
            return pair
        # Each sun lights one of the conditions, ambient light lights them all.
        shares = [1.0 / suns if light.number < suns else 1.0 for light in growing]
        gains = [share * light.variance / light.samples for share, light in zip(shares, growing, strict=True)]
        noisy = [light for light, gain in zip(growing, gains, strict=True) if gain >= WORTH * max(gains)]
        reliefs.reverse()
        _render(noisy, reliefs, [light.samples for light in noisy], "rendering with more samples")


def change_from(scene: Scene, before: Batches, relief: Array, samples: int, seed: int = 0) -> Array:
    """Change from the pictures before of `converged` to another relief, by some of their random numbers.

    Noise that both have in common cancels, so that few samples do.

    Args:
        scene: renders the pictures.
        before: of `converged`.
        relief: (rows, cols) mm.
        samples: a pixel, about, of those that `converged` took first.
        seed: as of `converged`.

    Returns:
        (conditions, rows, cols) radiance.
    """
    assert before.first is not None
    each = before.first_samples // BATCHES
    count = min(BATCHES, max(1, samples // each))
    seen = scene.levelled(relief)
    pictures = [scene.render(seen, samples=each, seed=number).numpy() for number in _seeds(seed, 0)[:count]]
    return np.asarray(np.mean(pictures, axis=0) - before.first[:count].mean(axis=0))


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
            shown = scene.render_colour(scene.levelled(relief), LEAST_SAMPLES, seed)
            pictures.append(np.moveaxis(shown, 0, -1))
            advance()
    return pictures[0], pictures[1]


@dataclass
class _LightPictures:
    """Pictures of two reliefs under one light.

    Attributes:
        light: renders the pictures.
        number: of the light.
        seed: of the random numbers.
        samples: a pixel so far, of all batches together.
        pictures: (2, batches, cameras, rows, cols) means of all samples so far.
    """

    light: LightScene
    number: int
    seed: int
    samples: int = 0
    pictures: Array | None = None

    @property
    def variance(self) -> float:
        """Variance of the mean change, averaged over the pixels."""
        assert self.pictures is not None
        change = self.pictures[1] - self.pictures[0]
        return float(change.var(axis=0, ddof=1).mean()) / len(change)

    def settings(self, samples: int) -> list[RenderSettings]:
        """Settings of the batches by which so many samples a pixel are added."""
        each = samples // BATCHES
        return [
            RenderSettings(each, number, shadow_edges=False) for number in _seeds(self.seed, self.samples)
        ]

    def add(self, pictures: Array, samples: int) -> None:
        """Add pictures (2, batches, cameras, rows, cols) of so many samples a pixel, all batches together."""
        total = self.samples + samples
        if self.pictures is not None:
            pictures = (self.samples * self.pictures + samples * pictures) / total
        self.pictures, self.samples = pictures, total


def _seeds(seed: int, samples: int) -> list[int]:
    """Seeds of the batches that come after so many samples."""
    return [int(number) for number in np.random.SeedSequence((seed, samples)).generate_state(BATCHES)]


def _render(
    lights: Sequence[_LightPictures], reliefs: Sequence[tuple[int, Array]], samples: Sequence[int], name: str
) -> None:
    """Add samples to the pictures of both reliefs.

    Args:
        lights: whose pictures gain.
        reliefs: numbers and heights, in the order in which they are rendered.
        samples: a pixel for each light, evenly over the batches, with random numbers of their own.
        name: of the stage.
    """
    added: list[list[list[Array]]] = [[[], []] for _ in lights]
    with stage(name, 2 * BATCHES * len(lights)) as advance:
        for number, heights in reliefs:
            for light, new, count in zip(lights, added, samples, strict=True):
                for settings in light.settings(count):
                    new[number].append(light_pictures(light.light, heights, settings, light.number))
                    advance()
    for light, new, count in zip(lights, added, samples, strict=True):
        light.add(np.array(new), count)


def _pictures(lights: Sequence[_LightPictures], suns: int, relief: int) -> Batches:
    each = [light.pictures[relief] for light in lights if light.pictures is not None]
    ambient = each[suns] if len(each) > suns else None
    return Batches(condition_pictures(each[:suns], ambient), min(light.samples for light in lights))
