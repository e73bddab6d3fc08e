"""Picture change with its uncertainty, estimated from independent batches.

Noise enlarges the mean and the root mean square of a difference, as noise never cancels in an absolute value
or a square. Independent batches (`visual.picture_noise`) give an unbiased square, and bounds of the mean. Up
to a factor, the root mean square of a condition is its term of E_vis, so both have the same relative error.
"""

from dataclasses import dataclass
from enum import Enum
from itertools import combinations

import numpy as np

from optimize.verification.verification import ChangePercent
from relief.ground.arrays import Array
from visual.picture_noise import Batches, jackknife_error

DETECTION_ERRORS = 2.0
"""Standard errors that a mean square must exceed to count as a change: 98 % confidence of a normal error."""

PRECISION = 0.15
"""Largest uncertainty of a change that counts as known, relative to the change: half the distance of the
bounds of the mean, and the standard error of the root mean square. The estimate of the mean then lies within
2.1 % of converged pictures on the six demo runs (docs/evidence/speed.md)."""


class Certainty(Enum):
    """How well the change of pictures is known; the value is the sentence for a person."""

    SAME = "The pictures are the same."
    KNOWN = "The noise of the pictures is small beside their change."
    COARSE = "The noise of the pictures blurs their change by more than 15 %."
    WITHIN_NOISE = "The change of the pictures is no larger than their noise."

    @property
    def settled(self) -> bool:
        """Whether more samples would change no digit that is shown."""
        return self in (Certainty.SAME, Certainty.KNOWN)


@dataclass(frozen=True)
class Change:
    """A change of pictures, in the unit of the pictures.

    Attributes:
        estimate: middle between `mean` and `mean_at_least`: of all these the nearest to converged pictures
            (docs/explanation/verification.md).
        mean: mean absolute difference of the mean pictures; its expectation is not below the true value.
        mean_error: standard error of `mean`, its spread over other random numbers.
        mean_at_least: mean absolute difference whose expectation is not above the true value.
        noise_floor: expectation of `mean` for equal true pictures with the same noise.
        rms: root mean square difference of the mean pictures; its expectation is not below the true value.
        rms_less_noise: root of `square`, or 0 where `square` is negative.
        rms_error: standard error of `rms_less_noise` upward.
        square, square_error: unbiased mean square difference and its standard error.
    """

    estimate: float
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
        """How well the change is known."""
        if self.rms == 0.0:
            return Certainty.SAME
        if self.square <= DETECTION_ERRORS * self.square_error or self.mean <= self.noise_floor:
            return Certainty.WITHIN_NOISE
        half_range = 0.5 * (self.mean - self.mean_at_least)
        precise = self.rms_error <= PRECISION * self.rms_less_noise and half_range <= PRECISION * self.mean
        return Certainty.KNOWN if precise else Certainty.COARSE

    def percent_of(self, level: float) -> ChangePercent:
        """All attributes but the squares, in percent of a radiance."""
        names = ChangePercent.model_fields
        return ChangePercent(**{name: percent_of(getattr(self, name), level) for name in names})


def percent_of(value: float, level: float) -> float:
    """A value in percent of a radiance; 0 of a black picture, which has no level."""
    return 100.0 * float(value) / float(level) if level > 0.0 else 0.0


def change(before: Batches, after: Batches, *, weights: Array | float = 1.0) -> Change:
    """The change between two sets of pictures.

    With common random numbers most of the noise cancels in the difference, so the noise is measured by the
    spread of the differences from batch to batch.

    Args:
        before, after: of the same shape; batch n of both has the same random numbers.
        weights: (conditions, rows, cols) of the pixels in every mean, with mean 1; all alike by default.
    """
    raw = after.pictures - before.pictures
    differences, rooted = raw * weights, raw * np.sqrt(weights)
    whole = rooted.mean(axis=0)
    square, error = crossed_square(rooted), jackknife_error(crossed_square, rooted)
    root = float(np.sqrt(max(square, 0.0)))
    return Change(
        estimate=magnitude(differences),
        mean=_mean_magnitude(differences),
        mean_error=jackknife_error(_mean_magnitude, differences),
        mean_at_least=crossed_magnitude(differences),
        noise_floor=noise_floor(differences),
        rms=float(np.sqrt(np.square(whole).mean())),
        rms_less_noise=root,
        # Not error / (2 root), the limit for small errors, which is undefined where the root is 0.
        rms_error=float(np.sqrt(max(square, 0.0) + error)) - root,
        square=square,
        square_error=error,
    )


def crossed_square(differences: Array) -> float:
    """Unbiased mean square of a picture: the mean product of two different batches.

    The noise of two batches is independent, so its product has expectation 0 (Hoeffding 1948, U-statistics).

    Args:
        differences: (batches, ...) independent, unbiased estimates of the picture.
    """
    count = len(differences)
    products = np.square(differences.sum(axis=0)) - np.square(differences).sum(axis=0)
    return float(products.mean()) / (count * (count - 1))


def magnitude(differences: Array) -> float:
    """Mean absolute value of a picture: the middle of its bounds, `Change.estimate`.

    Args:
        differences: (batches, ...) independent, unbiased estimates of the picture.
    """
    return max(0.0, 0.5 * (_mean_magnitude(differences) + crossed_magnitude(differences)))


def crossed_magnitude(differences: Array) -> float:
    """Mean absolute value of a picture, with an expectation not above the true value.

    Each batch is multiplied by the sign of the sum of the others. Its noise, independent of this sign, has
    expectation 0, and a wrong sign can only lower the value.

    Args:
        differences: (batches, ...) independent, unbiased estimates of the picture.
    """
    total = differences.sum(axis=0)
    return float(np.mean([(np.sign(total - one) * one).mean() for one in differences]))


def noise_floor(differences: Array) -> float:
    """Mean absolute value of the noise in the mean of all batches.

    The mean of one half of the batches less that of the other half, halved, contains the same noise and no
    picture. The value is the average over all ways to halve the batches.

    Args:
        differences: (batches, ...) independent, unbiased estimates of a picture; an even number of batches.
    """
    count = len(differences)
    total = differences.sum(axis=0)
    # Each pair of halves once: the half that is listed contains batch 0.
    halves = [(0, *others) for others in combinations(range(1, count), count // 2 - 1)]
    rest = [2.0 * differences[list(half)].sum(axis=0) - total for half in halves]
    return float(np.mean([np.abs(noise).mean() for noise in rest])) / count


def _mean_magnitude(differences: Array) -> float:
    return float(np.abs(differences.mean(axis=0)).mean())
