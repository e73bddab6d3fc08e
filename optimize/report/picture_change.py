"""How far pictures changed, and what their noise has to do with it.

Noise makes the mean and the root mean square of a difference larger, as it never cancels in an absolute value
or a square. From independent batches (`visual.noise`) the square can be had without it; of the mean, bounds.
Up to a factor, the root mean square of one condition is its term of E_vis: its standard error is the loss's.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import Enum
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from visual.noise import Batches, jackknife_error

Array = NDArray[np.float64]

SEEN = 2.0
"""Standard errors by which a square must lie above zero to count as a change."""

PRECISE = 0.1
"""Largest uncertainty of a change that counts as known, as a share of the change."""


class Certainty(Enum):
    """Whether a change of pictures is more than their noise; the value is the sentence shown."""

    SAME = "The pictures are the same."
    KNOWN = "The noise of the pictures is small beside their change."
    COARSE = "The noise of the pictures blurs their change by more than a tenth."
    WITHIN_NOISE = "The change of the pictures is no larger than their noise."


@dataclass(frozen=True)
class Change:
    """A change in the unit of the pictures.

    Attributes:
        mean: mean absolute difference of the mean pictures; on average at least the true one.
        mean_error: its standard error, that is how far it would differ with other random numbers.
        mean_at_least: one that noise does not enlarge; on average at most the true one.
        noise_floor: what `mean` would be if the true pictures were the same, the noise as it is.
        rms: root mean square difference of the mean pictures; on average at least the true one.
        rms_less_noise: from the unbiased square; 0 where that is negative.
        rms_error: standard error of `rms_less_noise`, toward above.
        square, square_error: unbiased mean square difference and its standard error.
    """

    mean: float
    mean_error: float
    mean_at_least: float
    noise_floor: float
    rms: float
    rms_less_noise: float
    rms_error: float
    square: float
    square_error: float

    @property
    def certainty(self) -> Certainty:
        """What may be said of it."""
        if self.rms == 0.0:
            return Certainty.SAME
        if self.square <= SEEN * self.square_error or self.mean <= self.noise_floor:
            return Certainty.WITHIN_NOISE
        between = 0.5 * (self.mean - self.mean_at_least)
        known = self.rms_error <= PRECISE * self.rms_less_noise and between <= PRECISE * self.mean
        return Certainty.KNOWN if known else Certainty.COARSE

    def percent_of(self, level: float) -> dict[str, float]:
        """Every length, that is all but the squares, in percent of a radiance."""
        lengths = [field.name for field in fields(self) if not field.name.startswith("square")]
        return {name: 100.0 * getattr(self, name) / float(level) for name in lengths}


def change(before: Batches, after: Batches) -> Change:
    """The change between pictures whose batches share their random numbers, number by number.

    With common random numbers most of the noise cancels in the difference, hence it is judged by the
    differences' own spread from batch to batch.
    """
    differences = after.pictures - before.pictures
    whole = np.asarray(differences.mean(axis=0))
    square, error = crossed_square(differences), jackknife_error(crossed_square, differences)
    root = float(np.sqrt(max(square, 0.0)))
    return Change(
        mean=float(np.abs(whole).mean()),
        mean_error=jackknife_error(_mean_magnitude, differences),
        mean_at_least=crossed_magnitude(differences),
        noise_floor=noise_floor(differences),
        rms=float(np.sqrt(np.square(whole).mean())),
        rms_less_noise=root,
        # Not error / (2 root), its limit for small errors: that has no value where the root is 0.
        rms_error=float(np.sqrt(max(square, 0.0) + error)) - root,
        square=square,
        square_error=error,
    )


def crossed_square(differences: Array) -> float:
    """Unbiased mean square of what batches (batches, ...) estimate: the mean product of differing batches.

    Their noise is independent, hence its product is 0 on average (Hoeffding 1948, U-statistics).
    """
    count = len(differences)
    products = np.square(differences.sum(axis=0)) - np.square(differences).sum(axis=0)
    return float(products.mean()) / (count * (count - 1))


def crossed_magnitude(differences: Array) -> float:
    """A mean absolute value of what batches (batches, ...) estimate, on average not above the true one.

    Each batch counts by the sign that the others have: noise cancels, and a wrong sign can only subtract.
    """
    total = differences.sum(axis=0)
    return float(np.mean([(np.sign(total - one) * one).mean() for one in differences]))


def noise_floor(differences: Array) -> float:
    """Mean absolute value of the noise in the mean of an even number of batches (batches, ...).

    Half of the batches less the other half has as much noise as the mean of all, and nothing else; averaged
    over all ways to halve them.
    """
    count = len(differences)
    total = differences.sum(axis=0)
    # Each halving once: batch 0 belongs to the half that is named.
    halves = [(0, *others) for others in combinations(range(1, count), count // 2 - 1)]
    rest = [2.0 * differences[list(half)].sum(axis=0) - total for half in halves]
    return float(np.mean([np.abs(noise).mean() for noise in rest])) / count


def _mean_magnitude(differences: Array) -> float:
    return float(np.abs(differences.mean(axis=0)).mean())
