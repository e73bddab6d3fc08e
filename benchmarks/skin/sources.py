"""What was measured on fingers: the numbers that fit a finger.

No source goes above 2 N, so that the paper's ink print at 8.8 N is none.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Mechanical:
    """A mechanical measurement of fingers, whose residuals are logarithms of model over measured.

    Attributes:
        name: short, for tables.
        what: what was measured, with its unit.
        at: where: widths or depths, mm.
        values: measured at each of them.
        people: least and greatest of the people at each of them, where the source has them.
        source: who measured.
        common: standard deviation of the logarithm that all values share.
        own: standard deviation of the logarithm of each value by itself.
        noise: why these two.
    """

    name: str
    what: str
    at: tuple[float, ...]
    values: tuple[float, ...]
    people: tuple[tuple[float, float], ...]
    source: str
    common: float
    own: float
    noise: str


GROOVE_FORCE_N = 2.0
"""Force of the finger on the grooves, N ("about")."""
SPHERE_DIAMETERS_MM = (3.0, 5.0)
"""Range of the sphere's diameter, mm: the source does not say which; all of it is as likely."""
FIRST_FORCE_N = 0.01
"""Force from which the sphere's depth counts, N."""

_PEOPLE = 7
_SPHERE_PEOPLE = ((0.025, 0.10), (0.064, 0.23), (0.13, 0.40))
_RANGE_OF_SEVEN = 2.704
"""Expected range of seven draws of a normal distribution, in its standard deviations."""
PEOPLE_SPREAD = sum(math.log(high / low) for low, high in _SPHERE_PEOPLE) / (
    len(_SPHERE_PEOPLE) * _RANGE_OF_SEVEN
)
"""Standard deviation of the logarithm of people's forces on the sphere, from the range of seven: 0.47."""

GROOVES = Mechanical(
    "grooves",
    "how deep the pad sinks into a groove between lands as wide, mm",
    (0.35, 0.5, 0.75, 1.0, 1.2, 1.5),
    (0.06, 0.10, 0.17, 0.28, 0.366, 0.40),
    (),
    "Gibson and Craig 2006, figure 5, about 2 N, as a laboratory's scripts quote it; that lands are as wide "
    "as grooves, and that depth is that at the groove's middle, is assumed",
    0.2,
    0.1,
    "assumed: 0.2 for the force, which is given as about 2 N, and for the people, who are others; 0.1 for "
    "what was read off a figure",
)
SPHERE = Mechanical(
    "sphere",
    "force on a sphere of 3 to 5 mm diameter that is pushed into the pad, N; depth counts from 0.01 N",
    (0.5, 1.0, 1.5),
    (0.042, 0.098, 0.22),
    _SPHERE_PEOPLE,
    "load frame of the same laboratory (unpublished): median and range of seven index fingers",
    PEOPLE_SPREAD * math.sqrt(math.pi / 2.0 / _PEOPLE),
    0.1,
    "common: standard error of the median of seven people whose logarithms spread by 0.47; 0.1: assumed",
)
MECHANICAL = (GROOVES, SPHERE)
