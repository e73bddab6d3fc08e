"""Plates under a round finger: those of `stimuli` on its larger patch, at phases that stand for every place.

The finger and a square lattice share the square's symmetries, so that phases between 0 and half a period, one
at most as large as the other, stand for all. Midpoints of a grid of these have the weights of their images.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from benchmarks.skin.experiment_plates import (
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
from benchmarks.skin.sources import HUMAN_SA1, MACAQUE_SA1, judged_roughness
from relief.ground.arrays import Array
from retouch.laboratory.published.stimuli import midpoints, weighed

MOST_MM = 6.0
"""Period of which longer ones are pressed at as few phases, three midpoints along half a period."""
FAR_MM = (1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.25, 8.5)
"""Spacings of the series "spacing, high": those of `MACAQUE_SA1` and those to the end of Dépeault 2009."""
GROOVES_MM = (0.25, 0.5, 1.0, 1.5, 2.0)
RIDGES_MM = (0.1, 0.5, 1.0)
"""Widths of grooves and ridges, those of Yoshioka 2001; their depth is assumed."""
GROOVE_DEPTH_MM = 1.0
PAIRS = tuple((groove, ridge) for ridge in RIDGES_MM for groove in GROOVES_MM if groove > 0.5 or ridge < 1.0)
"""Grooves and ridges of the series "grooves"."""
JUDGED = tuple(judged_roughness(*pair) for pair in PAIRS)


Plates = tuple[Array, Array]
"""Weights (phases) that sum to one, and heights (phases, n, n) in mm."""


def phases(apart: float) -> list[tuple[float, tuple[float, float]]]:
    """Weight and phase (rows, columns) of plates that repeat every `apart` mm along both axes."""
    return weighed(_middles(apart), _middles(apart))


def _middles(period: float) -> list[float]:
    return midpoints(min(period, MOST_MM))


def dot_plates(dot: float, high: float, apart: float) -> Plates:
    """Dots as in `stimuli.dots`."""
    every = phases(apart)
    plates = [dots(dot, high, apart, phase, ROUND_SAMPLES) for _, phase in every]
    return np.array([weight for weight, _ in every]), np.array(plates)


def _lines(draw: Callable[[float], Array], period: float) -> Plates:
    middles = _middles(period)
    return np.full(len(middles), 1.0 / len(middles)), np.array([draw(phase) for phase in middles])


def grating_plates(half: float, square: bool) -> Plates:
    """Gratings 0.3 mm high as in `stimuli.grating`."""
    return _lines(lambda phase: grating(half, 0.3, square, phase, ROUND_SAMPLES), 2.0 * half)


def groove_plates(groove: float, ridge: float) -> Plates:
    """Gratings as in `stimuli.grooves`."""
    return _lines(lambda phase: grooves(groove, ridge, GROOVE_DEPTH_MM, phase, ROUND_SAMPLES), groove + ridge)


def round_series(name: str) -> Iterator[Plates]:
    """The plates of a series, in the order of its values: one of `stimuli.series`, or of the new sources."""
    values = {one.name: one.values for one in series()}
    human, macaque = HUMAN_SA1, MACAQUE_SA1
    every: dict[str, Iterable[Plates]] = {
        "spacing": (dot_plates(DOT_MM, HIGH_MM, apart) for apart in values["spacing"]),
        "diameter": (dot_plates(dot, HIGH_MM, APART_MM) for dot in values["diameter"]),
        "diameter, high": (dot_plates(dot, 0.62, APART_MM) for dot in values["diameter, high"]),
        "height": (dot_plates(DOT_MM, high, APART_MM) for high in values["height"]),
        "waves": (grating_plates(half, False) for half in values["waves"]),
        "ridges": (grating_plates(half, True) for half in values["ridges"]),
        "human SA1": (dot_plates(human.dot_mm, human.high_mm, apart) for apart in human.spacings_mm),
        "spacing, high": (dot_plates(macaque.dot_mm, macaque.high_mm, apart) for apart in FAR_MM),
        "grooves": (groove_plates(*pair) for pair in PAIRS),
    }
    return iter(every[name])


def mirrored(heights: Array) -> Array:
    """(..., n, n) heights of 10 mm on the round finger's patch, continued by mirror images."""
    more = ROUND_SAMPLES - heights.shape[-1]
    before = more // 2
    edges = [(0, 0)] * (heights.ndim - 2) + [(before, more - before)] * 2
    return np.pad(heights, edges, mode="symmetric")


def natural_plates() -> Array:
    """(textures, n, n) mm: the natural reliefs on the round finger's patch."""
    return mirrored(natural())
