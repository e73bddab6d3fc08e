"""Plates under a round finger: those of `stimuli` on its larger patch, at phases that stand for every place.

The finger and a square lattice share the square's symmetries, so that phases between 0 and half a period, one at
most as large as the other, stand for all. Midpoints of a grid of these have the weights of their mirror images.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.skin.sources import HUMAN_SA1, MACAQUE_SA1, judged_roughness
from benchmarks.skin.stimuli import (
    APART_MM,
    DOT_MM,
    HIGH_MM,
    ROUND_SAMPLES,
    dots,
    grating,
    grooves,
    natural,
    series,
)
from relief.common.arrays import Array

NARROW_MM, WIDE_MM = 2.6, 3.3
"""Periods up to which one and two midpoints along half a period suffice; of longer ones three are taken. V of
dots 2.5 mm apart is the same to seven digits at three phases."""
FAR_MM = (1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.25, 8.5)
"""Spacings of the series "spacing, high": those of `MACAQUE_SA1` and those to the end of Dépeault 2009."""
GROOVES_MM = (0.25, 0.5, 1.0, 1.5, 2.0)
RIDGES_MM = (0.1, 0.5, 1.0)
"""Widths of grooves and ridges, those of Yoshioka 2001; their depth is assumed."""
GROOVE_DEPTH_MM = 1.0
PAIRS = tuple(
    (groove, ridge) for ridge in RIDGES_MM for groove in GROOVES_MM if groove > 0.5 or ridge < 1.0
)
"""Grooves and ridges of the series "grooves"."""
JUDGED = tuple(judged_roughness(*pair) for pair in PAIRS)


@dataclass(frozen=True)
class RoundSeries:
    """Plates that differ in one length.

    Attributes:
        name: of the series.
        values: of the length, mm.
        plates: for each value, weights (phases) that sum to one and heights (phases, n, n) mm.
    """

    name: str
    values: tuple[float, ...]
    plates: Callable[[], Iterator[tuple[Array, Array]]]


def phases(apart: float) -> list[tuple[float, tuple[float, float]]]:
    """Weight and phase (rows, columns) of plates that repeat every `apart` mm along both axes."""
    count = _midpoints(apart)
    middles = [(2 * number + 1) / (4 * count) for number in range(count)]
    return [
        ((1.0 if one == other else 2.0) / count**2, (middles[one], middles[other]))
        for one in range(count)
        for other in range(one, count)
    ]


def _midpoints(period: float) -> int:
    return 1 + (period > NARROW_MM) + (period > WIDE_MM)


def dot_plates(dot: float, high: float, apart: float) -> tuple[Array, Array]:
    """Weights (phases) and heights (phases, n, n), mm, of dots as in `stimuli.dots`."""
    every = phases(apart)
    plates = [dots(dot, high, apart, phase, ROUND_SAMPLES) for _, phase in every]
    return np.array([weight for weight, _ in every]), np.array(plates)


def _lines(draw: Callable[[float], Array], period: float) -> tuple[Array, Array]:
    count = _midpoints(period)
    middles = [(2 * number + 1) / (4 * count) for number in range(count)]
    return np.full(count, 1.0 / count), np.array([draw(phase) for phase in middles])


def round_series() -> dict[str, RoundSeries]:
    """Every series by name: those of `stimuli.series`, and those that only the new sources have."""
    values = {one.name: one.values for one in series()}

    def of_dots(name: str, lengths: tuple[float, ...], plate: Callable[[float], tuple[Array, Array]]) -> None:
        found[name] = RoundSeries(name, lengths, lambda: (plate(length) for length in lengths))

    found: dict[str, RoundSeries] = {}
    of_dots("spacing", values["spacing"], lambda apart: dot_plates(DOT_MM, HIGH_MM, apart))
    of_dots("diameter", values["diameter"], lambda dot: dot_plates(dot, HIGH_MM, APART_MM))
    of_dots("diameter, high", values["diameter, high"], lambda dot: dot_plates(dot, 0.62, APART_MM))
    of_dots("height", values["height"], lambda high: dot_plates(DOT_MM, high, APART_MM))
    for name in ("waves", "ridges"):
        of_dots(
            name,
            values[name],
            lambda half, square=name == "ridges": _lines(  # type: ignore[misc]
                lambda phase: grating(half, 0.3, square, phase, ROUND_SAMPLES), 2.0 * half
            ),
        )
    human, macaque = HUMAN_SA1, MACAQUE_SA1
    of_dots(
        "human SA1", human.spacings_mm, lambda apart: dot_plates(human.dot_mm, human.high_mm, apart)
    )
    of_dots("spacing, high", FAR_MM, lambda apart: dot_plates(macaque.dot_mm, macaque.high_mm, apart))
    found["grooves"] = RoundSeries(
        "grooves",
        tuple(float(number) for number in range(len(PAIRS))),
        lambda: (
            _lines(
                lambda phase, pair=pair: grooves(*pair, GROOVE_DEPTH_MM, phase, ROUND_SAMPLES),  # type: ignore[misc]
                sum(pair),
            )
            for pair in PAIRS
        ),
    )
    return found


def mirrored(heights: Array) -> Array:
    """(..., n, n) heights of 10 mm on the round finger's patch, continued by mirror images."""
    more = ROUND_SAMPLES - heights.shape[-1]
    before = more // 2
    edges = [(0, 0)] * (heights.ndim - 2) + [(before, more - before)] * 2
    return np.pad(heights, edges, mode="symmetric")


def natural_plates() -> Array:
    """(textures, n, n) mm: the natural reliefs on the round finger's patch."""
    return mirrored(natural())
