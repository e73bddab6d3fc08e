"""A coupon: one small plate with gratings, lines, dots, slopes and steps, which measures a printer.

All lengths here are in mm at scale 1, for pixels of 50 um; for other printers the whole plate is scaled.
Gratings and lines are slanted, so that their edges meet every part of a printer's pixels, as edges of
resolution charts do (ISO 12233).
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, radians, sin, tan

import numpy as np

from relief.ground.arrays import Array
from relief.printers import Printer
from relief.relief import Relief
from relief.solids.export.pixel_font import bitmap

SIDE_MM, SAMPLES = 24.0, 640
"""Side of the coupon and samples along it; a plate of 0.8 million triangles."""
PITCH_MM = SIDE_MM / SAMPLES
"""Distance of the samples."""
BASE_PIXEL_UM = 50.0
"""Pixel of the printers for which the scale is 1."""
LEAST_SCALE, MOST_SCALE = 0.5, 2.5
"""Least and greatest scale: a finer coupon has no room for labels, a larger one is slow to scan."""
FLOOR_MM, HIGH_MM = 0.3, 0.3
"""Height of the plane between features, and of ridges and dots above the plane."""
SLANT_DEGREES = 7.0
"""Angle between the lines of a field and y."""
PITCHES_MM = (0.15, 0.2, 0.3, 0.4, 0.6, 0.8, 1.2, 1.6)
"""Pitches of the gratings, ridges of half a pitch."""
WIDTHS_MM = (0.075, 0.1, 0.15, 0.2, 0.3, 0.45, 0.6, 0.9)
"""Widths of single ridges and grooves, and diameters of dots."""
SLOPES_DEGREES = (15.0, 30.0, 45.0, 60.0, 70.0, 80.0)
"""Angles of the wedges."""
WEDGE_MM = 0.6
"""Height of the wedges above the plane."""
STEPS, STEP_MM = 8, 0.1
"""Number of steps of the staircase, and height of each."""
RAMP_MM = 0.8
"""Rise of the long ramp, which shows layers as terraces."""
DOT_COPIES = 3
LABEL_PIXEL_MM, LABEL_MM = 0.1125, 0.15
"""Side of a pixel of the engraved labels, and their depth."""


@dataclass(frozen=True)
class Field:
    """A rectangle of the coupon with one feature.

    Attributes:
        kind: "grating", "ridge", "groove", "dot", "slope", "ramp" or "steps".
        size: pitch, width or diameter, mm; angle, degrees; rise, mm.
        x, y: of the lower left corner from that of the plate, mm.
        wide, high: extents, mm.
        at: x of the middle of a line or of the foot of a slope, mm from the left of the field.
    """

    kind: str
    size: float
    x: float
    y: float
    wide: float
    high: float
    at: float = 0.0


def fields() -> Iterator[Field]:
    """The fields of the coupon, at scale 1."""
    for number, pitch in enumerate(PITCHES_MM):
        row, col = divmod(number, 4)
        yield Field("grating", pitch, 0.8 + 5.7 * col, 17.6 - 4.2 * row, 5.2, 3.0)
    left = 0.8
    for width in WIDTHS_MM:
        wide = 1.7 + 1.2 * width
        yield Field("ridge", width, left, 10.6, wide, 1.7, 0.5 * wide)
        yield Field("groove", width, left, 8.7, wide, 1.7, 0.5 * wide)
        yield Field("dot", width, left, 5.4, wide, 3.1, 0.5 * wide)
        left += wide + 0.6
    left = 0.8
    for angle in SLOPES_DEGREES:
        run = WEDGE_MM / tan(radians(angle))
        yield Field("slope", angle, left, 2.6, run + 1.7, 1.5, 0.5)
        left += run + 2.3
    yield Field("ramp", RAMP_MM, 0.8, 0.7, 10.6, 1.5)
    yield Field("steps", STEP_MM, 12.2, 0.7, STEPS * 1.3, 1.5)


def scale_for(printer: Printer | None) -> float:
    """Scale of the coupon for a printer; 1 without one."""
    pixel_um = BASE_PIXEL_UM if printer is None else printer.pixel_um
    return min(MOST_SCALE, max(LEAST_SCALE, pixel_um / BASE_PIXEL_UM))


def coupon(scale: float = 1.0) -> Relief:
    """The coupon as a relief; heights are scaled as well."""
    heights = np.full((SAMPLES, SAMPLES), FLOOR_MM)
    for field in fields():
        rows, cols = window(field)
        heights[rows, cols] += shape_of(field, *places(field))
    for text, x, y in _labels():
        _engrave(heights, text, x, y)
    _mark(heights)
    return Relief(scale * heights, scale * SIDE_MM, name="coupon")


def window(field: Field) -> tuple[slice, slice]:
    """Rows and columns of the samples of a field."""
    left, right = (round(each / PITCH_MM) for each in (field.x, field.x + field.wide))
    top, bottom = (SAMPLES - round(each / PITCH_MM) for each in (field.y + field.high, field.y))
    return slice(top, bottom), slice(left, right)


def places(field: Field) -> tuple[Array, Array]:
    """x and y (rows, cols) of the samples of a field from its lower left corner, mm at scale 1."""
    rows, cols = window(field)
    x = (np.arange(cols.start, cols.stop) + 0.5) * PITCH_MM - field.x
    y = SIDE_MM - (np.arange(rows.start, rows.stop) + 0.5) * PITCH_MM - field.y
    x, y = np.meshgrid(x, y)
    return x, y


def across(field: Field, x: Array, y: Array) -> Array:
    """Distance, mm, from the line of a field, or from the middle of a ridge, across the slanted lines."""
    angle = radians(SLANT_DEGREES)
    return cos(angle) * (x - field.at) + sin(angle) * (y - 0.5 * field.high)


def shape_of(field: Field, x: Array, y: Array) -> Array:
    """Heights (rows, cols) of a field above the plane, mm at scale 1."""
    if field.kind == "grating":
        phase = across(field, x, y) / field.size
        return HIGH_MM * _soft(0.25 - np.abs(phase - np.rint(phase)), field.size)
    if field.kind in ("ridge", "groove"):
        ridge = HIGH_MM * _soft(0.5 * field.size - np.abs(across(field, x, y)), 1.0)
        return ridge if field.kind == "ridge" else -ridge
    if field.kind == "dot":
        middles = dot_middles(field)
        away = np.min([np.hypot(x - one, y - other) for one, other in middles], axis=0)
        return HIGH_MM * _soft(0.5 * field.size - away, 1.0)
    if field.kind == "slope":
        return np.clip(across(field, x, y) * tan(radians(field.size)), 0.0, WEDGE_MM)
    if field.kind == "ramp":
        return field.size * x / field.wide
    return field.size * np.floor(np.clip(x / field.wide, 0.0, 1.0 - 1e-9) * STEPS)


def dot_middles(field: Field) -> list[tuple[float, float]]:
    """Middles of the dots of a field, which lie at other parts of a printer's pixels."""
    gap = field.high / DOT_COPIES
    return [(field.at + 0.021 * (n - 1), gap * (n + 0.5) + 0.013 * n) for n in range(DOT_COPIES)]


def _soft(inside: Array, unit_mm: float) -> Array:
    """1 inside and 0 outside of an edge: the share of a sample that lies within, so that widths are exact.

    Args:
        inside: distance from the edge, positive inside, in `unit_mm`.
        unit_mm: mm of that unit.
    """
    return np.clip(inside * unit_mm / PITCH_MM + 0.5, 0.0, 1.0)


def _labels() -> Iterator[tuple[str, float, float]]:
    """Texts, and their lower left corners: micrometres at scale 1, degrees."""
    yield "RETOUCH COUPON", 3.2, 22.2
    for field in fields():
        if field.kind == "grating":
            yield f"{1000.0 * field.size:.0f}", field.x + 1.6, field.y + field.high + 0.1
        if field.kind == "ridge":
            yield f"{1000.0 * field.size:.0f}", field.x, 12.4
        if field.kind == "slope":
            yield f"{field.size:.0f}", field.x + 0.3, 4.3


def _engrave(heights: Array, text: str, x: float, y: float) -> None:
    """Engrave a text into the plane."""
    letters = bitmap([text])
    times = round(LABEL_PIXEL_MM / PITCH_MM)
    letters = letters.repeat(times, axis=0).repeat(times, axis=1)
    row, col = SAMPLES - round(y / PITCH_MM) - len(letters), round(x / PITCH_MM)
    heights[row : row + len(letters), col : col + letters.shape[1]] -= LABEL_MM * letters


def _mark(heights: Array) -> None:
    """Raise an L in the upper left corner and a square in the upper right, as marks of turn and mirror."""
    one = round(0.6 / PITCH_MM)
    heights[one : 4 * one, one : 2 * one] = FLOOR_MM + HIGH_MM
    heights[3 * one : 4 * one, one : 4 * one] = FLOOR_MM + HIGH_MM
    heights[one : 3 * one, -3 * one : -one] = FLOOR_MM + HIGH_MM
