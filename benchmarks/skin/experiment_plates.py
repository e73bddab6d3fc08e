"""Plates of published experiments, cut to the finger's patch: dots in a square lattice, and gratings.

The sources state lengths that are used here; the shapes of a dot and of a grating are choices of this study.
A lattice wider than the patch shows less than a period, so that every plate is pressed at several phases.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights

SAMPLES = 128
ROUND_SAMPLES = 208
"""Samples a side of the patch of a round finger, 16.25 mm, which are as large as those of the flat one's."""
FINER = 4
"""Points along a sample's side over which heights are averaged."""
PHASES = ((0.0, 0.0), (1.0 / 3.0, 2.0 / 3.0), (2.0 / 3.0, 1.0 / 3.0))
"""Shifts of a plate along both axes, in periods."""
SLOPE = math.tan(math.radians(60.0))
"""Slope of the side of a dot."""
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
    rows, cols = _points(samples)
    down, right = (
        ((x / apart + shift) % 1.0 - 0.5) * apart for x, shift in zip((rows, cols), phase, strict=True)
    )
    return _averaged(np.clip(high - SLOPE * (np.hypot(down, right) - 0.5 * dot), 0.0, high))


def grating(half_period: float, high: float, square: bool, phase: float, samples: int = SAMPLES) -> Array:
    """(n, n) mm: waves across x, or ridges as wide as their gaps with sides as steep as a dot's."""
    _, cols = _points(samples)
    turn = (cols / (2.0 * half_period) + phase) % 1.0
    if not square:
        return _averaged(0.5 * high * (1.0 + np.cos(2.0 * np.pi * turn)))
    outside = (np.minimum(turn, 1.0 - turn) - 0.25) * 2.0 * half_period
    return _averaged(np.clip(0.5 * high - SLOPE * outside, 0.0, high))


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


def grooves(groove: float, ridge: float, high: float, phase: float, samples: int = SAMPLES) -> Array:
    """(n, n) mm: ridges across x with tops of width `ridge`, `groove` apart, sides as steep as a dot's."""
    _, cols = _points(samples)
    period = groove + ridge
    turn = (cols / period + phase) % 1.0
    outside = np.minimum(turn, 1.0 - turn) * period - 0.5 * ridge
    return _averaged(np.clip(high - SLOPE * outside, 0.0, high))


def _points(samples: int) -> tuple[Array, Array]:
    pitch = PATCH_SIDE_MM / SAMPLES / FINER
    x = (np.arange(FINER * samples) + 0.5) * pitch
    rows, cols = np.meshgrid(x, x, indexing="ij")
    return rows, cols


def _averaged(fine: Array) -> Array:
    samples = fine.shape[0] // FINER
    return np.asarray(fine.reshape(samples, FINER, samples, FINER).mean(axis=(1, 3)))
