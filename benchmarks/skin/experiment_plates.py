"""Plates of published experiments, cut to the finger's patch: dots in a square lattice, and gratings.

The sources state lengths that are used here; the shapes of a dot and of a grating are choices of this study,
and their formulas those of `retouch.laboratory.published.stimuli`. Here they count from the patch's corner. A
lattice wider than the patch shows less than a period, so that every plate is pressed at several phases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights
from retouch.laboratory.published import stimuli
from retouch.laboratory.published.stimuli import FINER

SAMPLES = 128
ROUND_SAMPLES = 208
"""Samples a side of the patch of a round finger, 16.25 mm, which are as large as those of the flat one's."""
PHASES = ((0.0, 0.0), (1.0 / 3.0, 2.0 / 3.0), (2.0 / 3.0, 1.0 / 3.0))
"""Shifts of a plate along both axes, in periods."""
DOT_MM, HIGH_MM, APART_MM = 0.5, 0.35, 2.5
"""Diameter of a dot's flat top, height and spacing, where a series varies something else."""
NATURAL = (
    *("bark", "brick", "dots", "grass", "gravel", "knit"),
    *("leather", "pebbles", "scratches", "terrain", "waves", "weave"),
)
"""Bundled textures."""


@dataclass(frozen=True)
class Series:
    """Plates that differ in one length.

    Attributes:
        name: of the series.
        axis: what differs, with its unit.
        values: of the length, mm.
        heights: (values, phases, n, n), mm.
    """

    name: str
    axis: str
    values: tuple[float, ...]
    heights: Array


def series() -> list[Series]:
    """Every series of plates."""
    return [
        _dots("spacing", "spacing, mm", apart=(1.3, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.2)),
        _dots("diameter", "diameter, mm", dot=(0.25, 0.5, 1.0, 1.5)),
        _dots("diameter, high", "diameter, mm", dot=(0.25, 0.5, 1.0, 1.5), high=(0.62,)),
        _dots("height", "height, mm", high=(0.28, 0.35, 0.45, 0.62)),
        _gratings("waves", False),
        _gratings("ridges", True),
    ]


def natural() -> Array:
    """(textures, n, n) heights of the bundled textures, mm."""
    return np.stack([load_heights(find_texture(name)) for name in NATURAL])


def dots(dot: float, high: float, apart: float, phase: tuple[float, float], samples: int = SAMPLES) -> Array:
    """(n, n) mm: truncated cones in a square lattice, with flat tops of diameter `dot`."""
    down, right = (_points(samples) + (shift + 0.5) * apart for shift in phase)
    return stimuli.averaged(stimuli.dots(down[:, None], right, dot, high, apart))


def grating(half_period: float, high: float, square: bool, phase: float, samples: int = SAMPLES) -> Array:
    """(n, n) mm: waves across x, or ridges as wide as their gaps with sides as steep as a dot's."""
    x = _points(samples) + 2.0 * half_period * phase
    return _across(stimuli.grating(x, x, half_period, high, "square" if square else "sine"))


def grooves(groove: float, ridge: float, high: float, phase: float, samples: int = SAMPLES) -> Array:
    """(n, n) mm: ridges across x with tops of width `ridge`, `groove` apart, sides as steep as a dot's."""
    x = _points(samples) + (groove + ridge) * phase
    return _across(stimuli.grooves(x, x, groove, ridge, high))


def _dots(
    name: str,
    axis: str,
    dot: Sequence[float] = (DOT_MM,),
    high: Sequence[float] = (HIGH_MM,),
    apart: Sequence[float] = (APART_MM,),
) -> Series:
    values = max(dot, high, apart, key=len)
    plates = [[dots(d, h, a, phase) for phase in PHASES] for d in dot for h in high for a in apart]
    return Series(name, axis, tuple(values), np.array(plates))


def _gratings(name: str, square: bool) -> Series:
    halves = (0.25, 0.45, 0.8, 1.3, 2.0, 3.2, 5.2)
    plates = [[grating(half, 0.3, square, phase) for phase, _ in PHASES] for half in halves]
    return Series(name, "half period, mm", halves, np.array(plates))


def _points(samples: int) -> Array:
    """Positions from the corner of the patch, mm."""
    return np.asarray((np.arange(FINER * samples) + 0.5) * (PATCH_SIDE_MM / SAMPLES / FINER))


def _across(line: Array) -> Array:
    """(n, n) heights that are the same along y."""
    return stimuli.averaged(np.broadcast_to(line, (len(line), len(line))))
