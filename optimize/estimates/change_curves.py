"""Picture-change curves: how much a change of the feel changes the pictures, and where that becomes visible.

A curve goes through the ends of short descents (`optimize.estimates.reach`): a jnd + b jnd³ through both ends
toward rougher, in proportion toward smoother. Nothing here loads torch or a renderer, so that the server of
the app reads such curves without them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tactile.quantities import LARGEST_JND, LIMIT_PERCENT

if TYPE_CHECKING:
    from tactile.model import ModelName


@dataclass(frozen=True)
class ChangeCurve:
    """The picture-change curve in one sense, rougher or smoother, and where it passes the limit.

    Attributes:
        jnd: just-noticeable differences from the original, positive; `LARGEST_JND` at most, as a run.
        arrived: whether the short descents arrived at all their ends; else the relief gives no more, or only
            in many steps, and `jnd` is not more than what was reached; or it would be smooth (`tactile.jnd`)
            before the limit, and `jnd` ends there.
        ends: of the short descents, each as its JND and the mean change of the pictures in % of white.
    """

    jnd: float
    arrived: bool
    ends: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class Reach:
    """The reach both ways, with the models that estimated it.

    Attributes:
        mean_percent_of_white: mean radiance of the original's pictures over the plate, % of white.
    """

    rougher: ChangeCurve
    smoother: ChangeCurve
    touch: ModelName
    look: str
    mean_percent_of_white: float

    @property
    def limit_percent_of_mean(self) -> float:
        """The limit in % of the mean picture, the unit of the changes that runs report."""
        return 100.0 * LIMIT_PERCENT / self.mean_percent_of_white

    def change_percent(self, jnd: float) -> float:
        """About how much the pictures change, % of white, if the feel changes by so many JND."""
        rougher = jnd > 0.0
        slope, bend = _fitted((self.rougher if rougher else self.smoother).ends, rougher)
        return slope * abs(jnd) + bend * abs(jnd) ** 3

    def as_json(self) -> dict[str, Any]:
        """Everything, for `retouch evaluate --reach --json`."""
        limits = {
            "limit_percent_of_white": LIMIT_PERCENT,
            "limit_percent_of_mean": self.limit_percent_of_mean,
        }
        return asdict(self) | limits


def crossing(ends: Sequence[tuple[float, float]], bends: bool) -> float:
    """JND at which the change passes the limit, `LARGEST_JND` at most; arguments as of `_fitted`."""
    slope, bend = _fitted(ends, bends)
    if bend > 0.0:
        roots = np.roots([bend, 0.0, slope, -LIMIT_PERCENT])
        return min(LARGEST_JND, *(float(root.real) for root in roots if root.imag == 0.0 < root.real))
    return float(min(LIMIT_PERCENT / max(slope, 1e-9), LARGEST_JND))


def _fitted(ends: Sequence[tuple[float, float]], bends: bool) -> tuple[float, float]:
    """a and b of the change a jnd + b jnd³, % of white.

    Args:
        ends: JND and change of the pictures in % of white, each positive.
        bends: whether the curve goes through the last two ends, if there are two and b > 0; else b is 0, and
            the curve is the line from 0 to the last end.
    """
    jnd, change = ends[-1]
    rate = change / jnd
    if bends and len(ends) > 1:
        before, change_before = ends[-2]
        bend = (rate - change_before / before) / (jnd**2 - before**2)
        if bend > 0.0:
            return rate - bend * jnd**2, bend
    return rate, 0.0
