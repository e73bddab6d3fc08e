"""Trust in the linear model of a step: the damping of the step, and its largest length."""

from __future__ import annotations

from typing import NamedTuple, Self

import numpy as np

from optimize.descent.driver import ArraySchema

DAMPING = 1.0
"""Damping mu of the first step towards smoother goals, for pictures in units of their mean and heights in mm,
one pixel a sample."""
LARGEST_SHARE, LEAST_SHARE = 0.2, 0.002
"""Bounds of the share of its current value by which one step may change a target, except as follows."""
LEAST_FROM_SIDES = 0.02
"""The least share with views from the side: twice the usual tolerance, so that a step which better
pictures pull off a target can return to it at once. With 0.002, gravel at -2 JND in the scene `in-hand`
drifted off for 100 steps; with 0.02, the run takes 5 steps. From above, descents do not drift, and
corrections take the smaller share."""
RISING_SHARE = 1.0
"""The first share towards goals that all lie above their values. A rougher relief keeps its contact, so that
the slopes of roughness hold nearly all the way. A smoother one gets new contact: with such a first step the
bundled textures end at -2 JND with pictures up to 16 % worse, or after three times the steps."""
FALLING_SHARE = 0.1
"""The first share where a goal lies below its value. With 0.2 pictures at -2 JND change 19 % more on brick,
and 3 and 2 % more on gravel and grass, after one or two steps less."""
MISSED, HIT = 0.5, 0.25
"""Prediction errors, as shares of the step, above which damping grows and below which it falls."""
RAISED, EASED = 8.0, 0.25
"""Factors of the damping: growth where the prediction error is as large as the step (in proportion to
smaller errors), and fall. A fall by 0.5 made brick take two more steps for its last and smallest changes."""
LEAST_DAMPING, MOST_DAMPING = 1e-2, 1e4
"""Bounds of the damping mu."""
SCHEMA = ArraySchema((2,), LEAST_SHARE, MOST_DAMPING)
"""Shape and range of damping and share in a checkpoint."""


class Trust(NamedTuple):
    """Trust in the linear model: the damping mu, and the share of a target's value that a step may change."""

    damping: float
    share: float

    @classmethod
    def first(cls, rising: bool, slopes_hold: bool) -> Self:
        """The trust in the first step, by whether all goals lie above the values, and whether slopes hold.

        The pictures are linear enough for the least damping; only touch needs a larger one.
        """
        if rising and slopes_hold:
            return cls(LEAST_DAMPING, RISING_SHARE)
        return cls(DAMPING, LARGEST_SHARE if rising else FALLING_SHARE)

    def after(self, error: float, tried: float, least: float = LEAST_SHARE) -> Trust:
        """The trust in the next step.

        Args:
            error: prediction error of this step, as a share of its length.
            tried: the largest share of a target's value that this step meant to change.
            least: least share of the next step.
        """
        damping = self.damping * (RAISED * error if error > MISSED else EASED if error < HIT else 1.0)
        share = 0.5 * tried if error > MISSED else self.share * (1.5 if error < HIT else 1.0)
        return Trust(
            float(np.clip(damping, LEAST_DAMPING, MOST_DAMPING)),
            float(np.clip(share, least, max(self.share, LARGEST_SHARE))),
        )
