"""Stimuli of published experiments: rigid reliefs by formula, at positions from the middle of the contact.

A kind is a function of positions y along and x across the finger, which broadcast, and of lengths, all in mm.
"""

import math
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights

SLOPE, STEEP = math.tan(math.radians(60.0)), math.tan(math.radians(85.0))
"""Slope of the sides of dots and ridges, which sources do not state, and of steep ones."""
FINER = 4
"""Points along a sample's side over which heights are averaged."""
NARROW_MM, WIDE_MM = 2.6, 3.3
"""Periods up to which one and two midpoints along half a period suffice; of longer ones three are taken. V of
dots 2.5 mm apart is the same to seven digits at three phases."""
LONG_MM = 6.5
"""Period, mm, beyond which the narrowest contact may lie within one; each 2 mm more take another midpoint."""


def _from_middle(x: Array, period: float) -> Array:
    return np.asarray(((x / period + 0.5) % 1.0 - 0.5) * period)


def _raised(outside: Array, high_mm: float, slope: float = SLOPE) -> Array:
    return np.clip(high_mm - slope * outside, 0.0, high_mm)


def dots(y: Array, x: Array, top_mm: float, high_mm: float, apart_mm: float, across_mm: float = 0) -> Array:
    """Truncated cones `apart_mm` apart along x and `across_mm` along y, by default the same."""
    away = np.hypot(_from_middle(y, across_mm or apart_mm), _from_middle(x, apart_mm))
    return _raised(away - 0.5 * top_mm, high_mm)


def grating(y: Array, x: Array, half_mm: float, high_mm: float, wave: str) -> Array:
    """Waves across x ("sine"), or ridges ("square") as wide as their gaps at half their height."""
    if wave == "sine":
        return np.asarray(0.5 * high_mm * (1.0 + np.cos(np.pi * x / half_mm)))
    foot = 0.5 * high_mm / SLOPE
    return grooves(y, x, half_mm + 2.0 * foot, half_mm - 2.0 * foot, high_mm)


def grooves(y: Array, x: Array, groove_mm: float, ridge_mm: float, high_mm: float) -> Array:
    """Ridges across x with tops of width `ridge_mm`, `groove_mm` apart."""
    return _raised(np.abs(_from_middle(x, groove_mm + ridge_mm)) - 0.5 * ridge_mm, high_mm)


def bundled(y: Array, x: Array, texture: str) -> Array:
    """A bundled texture of 10 x 10 mm, continued by mirror images."""
    heights = _heights(texture)
    count = len(heights)
    numbers = (np.floor((each.ravel() / PATCH_SIDE_MM + 0.5) * count) % (2 * count) for each in (y, x))
    return heights[np.ix_(*(np.minimum(each, 2 * count - 1 - each).astype(int) for each in numbers))]


_heights = cache(lambda texture: load_heights(find_texture(texture)))
KINDS: Mapping[str, Callable[..., Array]] = {
    **{kind.__name__: kind for kind in (dots, grating, grooves, bundled)},
    # Half a sphere, and half a cylinder along y, on a plane; arcs along x and along y added.
    "sphere": lambda y, x, radius_mm: np.sqrt(np.clip(radius_mm**2 - y**2 - x**2, 0.0, None)),
    "cylinder": lambda y, x, radius_mm: np.sqrt(np.clip(radius_mm**2 - x**2, 0.0, None)),
    "toroid": lambda y, x, radius_mm, across_mm: (
        KINDS["cylinder"](y, x, radius_mm) + KINDS["cylinder"](x, y, across_mm)
    ),
    # A half-sine ramp across x; a Gaussian; a bar and a slot along y; a disc; a plane that bends down.
    "step": lambda y, x, high_mm, width_mm: (
        0.5 * high_mm * (1.0 + np.sin(np.pi * np.clip(x / width_mm, -0.5, 0.5)))
    ),
    "bump": lambda y, x, high_mm, sigma_mm: high_mm * np.exp(-0.5 * (y**2 + x**2) / sigma_mm**2),
    "bar": lambda y, x, width_mm, high_mm: np.where(np.abs(x) < 0.5 * width_mm, high_mm, 0.0),
    "gap": lambda y, x, width_mm, deep_mm: KINDS["bar"](y, x, width_mm, -deep_mm),
    "pin": lambda y, x, top_mm, high_mm: _raised(np.hypot(y, x) - 0.5 * top_mm, high_mm, STEEP),
    "edge": lambda y, x, angle_deg: -math.tan(math.radians(angle_deg)) * np.clip(x, 0.0, None),
}
"""By name, as findings have it."""
PERIODS: Mapping[str, Callable[..., tuple[float, float]]] = {
    "dots": lambda apart_mm, across_mm=0.0, **_: (across_mm or apart_mm, apart_mm),
    "grating": lambda half_mm, **_: (0.0, 2.0 * half_mm),
    "grooves": lambda groove_mm, ridge_mm, **_: (0.0, groove_mm + ridge_mm),
}
"""Periods along y and x of the kinds that have some, mm; 0 where nothing changes."""


def midpoints(period: float) -> list[float]:
    """Shifts along half a period, as shares of the period, that stand for every place of the finger."""
    count = 1 + (period > NARROW_MM) + (period > WIDE_MM) + math.ceil(max(0.0, period - LONG_MM) / 2.0)
    return [(2 * number + 1) / (4 * count) for number in range(count)]


def weighed(down: list[float], right: list[float]) -> list[tuple[float, tuple[float, float]]]:
    """Weights, which sum to one, and pairs of shifts. Of alike shifts a pair stands for its mirror image."""
    pairs = [(one, other) for one in down for other in right if down != right or one <= other]
    weights = [1.0 + (down == right and one != other) for one, other in pairs]
    return [(weight / sum(weights), pair) for weight, pair in zip(weights, pairs, strict=True)]


def averaged(fine: Array) -> Array:
    """(n, n) means of (n FINER, n FINER) heights over the areas of samples."""
    return np.asarray(fine.reshape(len(fine) // FINER, FINER, -1, FINER).mean(axis=(1, 3)))


def plates(stimulus: Mapping[str, Any], samples: int, pitch_mm: float) -> tuple[Array, Array]:
    """Weights (k,), which sum to one, and heights (k, n, n), mm, of the places of a stimulus.

    What repeats lies under the finger at shifts that stand for every place, and what does not, in the middle.
    """
    kind, values = stimulus["kind"], {name: value for name, value in stimulus.items() if name != "kind"}
    fine = (np.arange(FINER * samples) + 0.5) * pitch_mm / FINER - 0.5 * samples * pitch_mm
    periods = PERIODS[kind](**values) if kind in PERIODS else (0.0, 0.0)
    shifts = [[period * share for share in midpoints(period)] for period in periods]
    if kind in ("bar", "gap"):
        # How vertical walls lie between samples decides how wide these are on the grid.
        shifts[1] = [0.125 * pitch_mm, 0.375 * pitch_mm]
    places = weighed(*shifts)
    every = (KINDS[kind]((fine + down)[:, None], fine + right, **values) for _, (down, right) in places)
    heights = [averaged(np.broadcast_to(each, (len(fine), len(fine)))) for each in every]
    return np.array([weight for weight, _ in places]), np.array(heights)
