"""Published facts of touch, each with its source, and whether a skin gets it right.

A fact is a sign or a range that its source states; numbers of people are not compared with V. Facts marked
`fit` chose among the layered skins of the grid; the others are predicted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median
from typing import Any

from benchmarks.skin.experiment_plates import series
from benchmarks.skin.round_stimuli import FAR_MM, JUDGED
from benchmarks.skin.sources import HUMAN_SA1, MACAQUE_SA1, Recorded
from retouch.laboratory.published.rules import RULES, STEP, off_range, top

PEAK_MM = (2.0, 3.0)
"""Range of the spacing at which dots are roughest."""
NATURAL_ROUGHNESS = (0.03, 0.12)
"""Range of natural reliefs in the paper."""
READINGS = (1.0, math.pi)
"""Factors of V by the two readings of equation 2: the mean over pairs, and as printed, with lengths in cm."""
ORDER_MM2 = math.sqrt(10.0)
"""Factor within which a contact area is "on the order of" another."""

CURVE = 0.15
"""Greatest rms by which a curve over its top may miss a recorded one over its own."""
CORRELATED = 0.9
"""Least correlation of V with what people judge; that of recorded SA1 afferents is 0.97 (Yoshioka 2001)."""

VALUES = {one.name: one.values for one in series()}
Measured = dict[str, Any]


@dataclass(frozen=True)
class Outcome:
    """Outcome of a fact for a skin.

    Attributes:
        told: the numbers, as short text.
        right: whether they agree with the fact.
    """

    told: str
    right: bool


@dataclass(frozen=True)
class Fact:
    """A published fact.

    Attributes:
        name: short, for tables.
        says: what people do.
        source: who found it.
        of: the outcome of a skin by what it feels (`benchmarks.skin.plate_pressing.pressed`).
        fit: whether the fact chose a layered skin.
    """

    name: str
    says: str
    source: str
    of: Callable[[Measured], Outcome]
    fit: bool = False


def _by(rule: str, name: str, at: Sequence[float] = (), **values: Any) -> Callable[[Measured], Outcome]:
    """The outcome by a rule on a series whose plates differ by these lengths."""

    def outcome(felt: Measured) -> Outcome:
        return Outcome(*RULES[rule](felt[name], at, **values))

    return outcome


def _natural(felt: Measured) -> Outcome:
    low, high = NATURAL_ROUGHNESS
    middles = [factor * median(felt["natural"]) for factor in READINGS]
    numbers = " or ".join(
        f"{middle:.3f} ({_within(felt, factor)})" for middle, factor in zip(middles, READINGS, strict=True)
    )
    return Outcome(numbers, any(low <= middle <= high for middle in middles))


def in_range(felt: Measured) -> int:
    """How many natural reliefs lie in the paper's range, by the reading of equation 2 that has more."""
    return max(_within(felt, factor) for factor in READINGS)


def _within(felt: Measured, factor: float) -> int:
    low, high = NATURAL_ROUGHNESS
    return sum(low <= factor * one <= high for one in felt["natural"])


def _area(felt: Measured) -> Outcome:
    middle = median(felt["natural, mm2"])
    return Outcome(f"{middle:.0f} mm²", 100.0 / ORDER_MM2 <= middle <= 100.0)


FACTS = (
    Fact(
        "peak of spacing",
        "dots are roughest 2 to 3 mm apart",
        "Hollins and Bensmaïa 2007, as the paper cites them",
        _by("peak", "spacing", VALUES["spacing"], between=PEAK_MM),
        fit=True,
    ),
    Fact(
        "small dots",
        "at one spacing, small dots are rougher than large ones (0.35 mm high)",
        "Blake 1997, Tymms 2017",
        _by("ratio", "diameter", of=(0, -1), least=STEP),
        fit=True,
    ),
    Fact(
        "natural reliefs",
        "the median roughness of natural reliefs lies between 0.03 and 0.12, as the mean over pairs or with "
        "the factor pi of the printed equation 2 (in parentheses: how many of 12 lie there)",
        "the paper",
        _natural,
        fit=True,
    ),
    Fact(
        "small dots, high",
        "the same with dots 0.62 mm high",
        "Blake 1997, Tymms 2017",
        _by("ratio", "diameter, high", of=(0, -1), least=STEP),
    ),
    Fact(
        "spacing both ways",
        "dots 1.3 and 6.2 mm apart are both smoother than those between",
        "Hollins and Bensmaïa 2007; spacings of Blake 1997",
        _by("inverted U", "spacing", VALUES["spacing"]),
    ),
    Fact(
        "waves",
        "gratings 0.3 mm high are roughest between half periods of 0.25 and 5.2 mm, here as waves",
        "Drewing 2016",
        _by("inverted U", "waves", VALUES["waves"]),
    ),
    Fact(
        "ridges",
        "the same, here as ridges with steep sides",
        "Drewing 2016",
        _by("inverted U", "ridges", VALUES["ridges"]),
    ),
    Fact(
        "height",
        "roughness grows with the height of dots, 0.28 to 0.62 mm",
        "Blake 1997",
        _by("rises", "height"),
    ),
    Fact(
        "force",
        "roughness grows with force, here half to twice the skin's",
        "Lederman and Taylor 1972",
        _by("rises", "force"),
    ),
    Fact(
        "peak, exploring",
        "dots are roughest 2 to 3 mm apart, at a force of 0.6 N",
        "as the first; force of Smith 2002",
        _by("peak", "spacing, exploring", VALUES["spacing"], between=PEAK_MM),
    ),
    Fact(
        "contact area",
        "contact areas of natural reliefs are on the order of 100 mm²",
        "the paper, beside equation 7; its simulated areas equal ink prints at 8.8 N (figure 27)",
        _area,
    ),
)
"""Every fact, those of the fit first."""


def off_recorded(
    recorded: Recorded, spacings: Sequence[float], curve: Sequence[float]
) -> tuple[float, float]:
    """Rms by which a curve over its top lies outside a recorded range, and the spacing of its top, mm."""
    chosen = [curve[spacings.index(spacing)] for spacing in recorded.spacings_mm]
    return off_range(chosen, recorded.low, recorded.high), top(spacings, curve)


def _recorded(recorded: Recorded, name: str, spacings: Sequence[float]) -> Callable[[Measured], Outcome]:
    def outcome(felt: Measured) -> Outcome:
        off, at = off_recorded(recorded, spacings, felt[name])
        return Outcome(f"rms {off:.2f}, top {at:.1f} mm", off <= CURVE)

    return outcome


def _never_falls(felt: Measured) -> Outcome:
    curve = felt["spacing, high, exploring"]
    numbers = f"top {top(FAR_MM, curve):.1f} mm, then {curve[-1] / max(curve):.2f}"
    return Outcome(numbers, min(after / before for before, after in pairwise(curve)) >= STEP)


ADDED = (
    Fact(
        "human SA1",
        "mean rate over the spacing of dots 0.5 mm high, each over its top, at 0.6 N: rms at most 0.15",
        HUMAN_SA1.source,
        _recorded(HUMAN_SA1, "human SA1, exploring", HUMAN_SA1.spacings_mm),
    ),
    Fact(
        "macaque SA1",
        "difference of rates 1.4 to 3 mm apart over the spacing of dots 0.74 mm high, over its top: outside "
        "the range of the recordings by rms 0.15 at most",
        MACAQUE_SA1.source,
        _recorded(MACAQUE_SA1, "spacing, high, exploring", FAR_MM),
    ),
    Fact(
        "grooves and ridges",
        "judged roughness is 0.2 + 1.6 G - 0.5 R - 0.25 G² of grooves G and ridges R: V correlates by 0.9 at "
        "least, at 0.6 N on gratings 1 mm deep",
        "Yoshioka 2001",
        _by("correlates", "grooves, exploring", values=JUDGED, least=CORRELATED),
    ),
)
"""Facts that the sources of `benchmarks.skin.sources` add."""
AGAINST = Fact(
    "no inverted U",
    "roughness rises with the spacing of dots from 1.5 to 8.5 mm, here 0.74 mm high and at 0.6 N",
    "Dépeault 2009, against the others",
    _never_falls,
)
"""A fact that others contradict: told, and not counted."""
FINGER_FACTS = (*(fact for fact in FACTS if fact.name != "contact area"), *ADDED)
"""Facts of a finger whose force is far from the 8.8 N of the contact area."""
