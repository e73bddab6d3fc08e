"""How much of its relief a texture has where it lies."""

from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array
from relief.solids.body import Body

WHOLE = 0.99
"""Share of the relief from which it counts as whole."""


class Presence(NamedTuple):
    """How much of the relief is there.

    Attributes:
        whole_mm2: Area with the whole relief.
        largest: Largest share of the relief anywhere, 0 to 1.
    """

    whole_mm2: float
    largest: float


def presence(body: Body, share: Array) -> Presence:
    """Sum up shares (vertices,) of the relief, 0 to 1, over the triangles of a body."""
    whole = share[body.faces].mean(axis=1) >= WHOLE
    return Presence(float(body.areas[whole].sum()), float(share.max()))


def narrower(largest: float, falloff_mm: float) -> float:
    """The falloff, mm, with which a relief whose largest share is below 1 becomes whole at that place."""
    steps = np.linspace(0.0, 1.0, 1001)
    place = steps[np.searchsorted(steps**2 * (3.0 - 2.0 * steps), largest)]
    return float(place * falloff_mm)
