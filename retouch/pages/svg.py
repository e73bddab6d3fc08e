"""Small charts as HTML and SVG: lines, dots on a scale, colour bars, profiles.

The marks are SVG, stretched to the width of the page. The labels are HTML placed in percent, so that text
keeps its size on a narrow screen.
"""

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from relief.ground.arrays import FloatArray
from retouch.pages.colour_maps import PURPLE_ORANGE, Table, bar_uri
from retouch.pages.templates import html

PERCENTILE = 99.5
"""Percentile of a map's values where its colour scale ends, so that single pixels do not set the scale."""
Range = tuple[float, float]
"""Low and high end."""
Mark = tuple[str, Sequence[tuple[float, float]]]
"""CSS class of a line, and its points in percent of the drawing from its upper left corner."""


END_PERCENT = 4.0
"""Distance from an end of an axis, % of its length, within which a label is placed on the inner side."""


@dataclass(frozen=True)
class ChartAxis:
    """A linear axis.

    Attributes:
        low, high: its ends.
        ticks: round numbers, ascending.
    """

    low: float
    high: float
    ticks: tuple[float, ...]

    def percent(self, value: float) -> float:
        """Position of a value along the axis, 0 at `low` and 100 at `high`."""
        return 100.0 * (value - self.low) / (self.high - self.low)

    def down(self, value: float) -> float:
        """Position of a value from the upper end of a vertical axis, in percent."""
        return 100.0 - self.percent(value)

    def label(self, tick: float) -> str:
        """The number of a tick, with the decimals that the step between ticks needs."""
        step = self.ticks[1] - self.ticks[0] if len(self.ticks) > 1 else 1.0
        decimals = next((d for d in range(8) if math.isclose(round(step, d), step, rel_tol=1e-6)), 8)
        return f"{tick + 0.0:.{decimals}f}".replace("-", "\N{MINUS SIGN}")

    def whole(self) -> "ChartAxis":
        """The same axis with the ticks at whole numbers only."""
        return ChartAxis(self.low, self.high, tuple(t for t in self.ticks if t % 1 == 0))

    def side(self, tick: float) -> str:
        """CSS class, after a space, of a label that would reach beyond an end of the axis; else empty."""
        place = self.percent(tick)
        return " first" if place < END_PERCENT else " last" if place > 100.0 - END_PERCENT else ""


def nice_axis(low: float, high: float, count: int = 5, *, tight: bool = False) -> ChartAxis:
    """An axis over [low, high] whose ticks are multiples of 1, 2 or 5 times a power of ten.

    Args:
        low, high: range to cover; an empty range is widened.
        count: about how many steps between ticks.
        tight: end at `low` and `high` rather than at the ticks outside them.
    """
    if not high > low:
        low, high = low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0)
    rough = (high - low) / count
    power = 10.0 ** math.floor(math.log10(rough))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= rough * (1 - 1e-9))
    inward = 1e-9 if tight else -1e-9
    first, last = low / step, high / step
    start = math.ceil(first - inward) if tight else math.floor(first - inward)
    stop = math.floor(last + inward) if tight else math.ceil(last + inward)
    ticks = tuple(step * k for k in range(start, stop + 1))
    return ChartAxis(low, high, ticks) if tight else ChartAxis(ticks[0], ticks[-1], ticks)


def signed_axis(limit: float) -> ChartAxis:
    """An axis over [-limit, limit] with ticks at its ends, its middle and the quarters."""
    return ChartAxis(-limit, limit, tuple(limit * k / 2 for k in range(-2, 3)))


def signed_limit(values: FloatArray, least: float) -> float:
    """A round end of the scale of values of either sign, at least `least`; NaN does not count."""
    finite = np.abs(values[np.isfinite(values)])
    return round_up(max(float(np.percentile(finite, PERCENTILE)) if finite.size else least, least))


def round_up(value: float) -> float:
    """The least 1, 1.5, 2, 3, 5 or 8 times a power of ten that is not below a positive value."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * next(m for m in (1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 10.0) if m * power >= value * (1 - 1e-9))


@dataclass(frozen=True)
class Series:
    """One line of a chart.

    Attributes:
        name: label at its end; may be empty.
        x, y: (n,) coordinates.
        style: CSS class.
    """

    name: str
    x: Sequence[float]
    y: Sequence[float]
    style: str


@dataclass(frozen=True)
class Band:
    """A horizontal band with a line in its middle, for a target and its tolerance."""

    name: str
    low: float
    middle: float
    high: float


def line_chart(title: str, series: Sequence[Series], x_name: str, band: Band | None = None) -> Markup:
    """Lines over a common x axis, labelled at their ends; values that are not finite are left out."""
    xs = [x for line in series for x in line.x]
    ys = [y for line in series for y in line.y if math.isfinite(y)]
    extra = [band.low, band.high] if band else [0.0]
    x_axis = nice_axis(min(xs, default=0.0), max(xs, default=1.0), 6, tight=True)
    y_axis = nice_axis(min(ys + extra), max(ys + extra), 4)
    marks, ends = list[Mark](), []
    for line in series:
        finite = ((x, y) for x, y in zip(line.x, line.y, strict=True) if math.isfinite(y))
        points = [(x_axis.percent(x), y_axis.down(y)) for x, y in finite]
        if not points:
            continue
        marks.append((line.style, points))
        marks += [dot(line.style, *point) for point in (points if len(points) <= 40 else points[-1:])]
        ends.append((line.style, points[-1][1], line.name))
    return chart(title, marks, x_axis.whole(), y_axis, x_name, band=band, ends=ends)


def chart(
    title: str, marks: Sequence[Mark], x_axis: ChartAxis, y_axis: ChartAxis, x_name: str, **parts: Any
) -> Markup:
    """Marks over two axes, with other parts of the template: `band`, `ends` of lines, `legend`."""
    axes = {"x_axis": x_axis, "y_axis": y_axis, "x_name": x_name}
    return html("line_chart.html.j2", title=title, marks=marks, **axes, **parts)


def dot(style: str, x: float, y: float) -> Mark:
    """A circle, as a line of length 0 with round ends: it stays one when the drawing is stretched."""
    return f"{style} dot", [(x, y), (x, y)]


@dataclass(frozen=True)
class Dot:
    """One row of a dot chart: name, position, text beside the dot, CSS class."""

    name: str
    value: float
    text: str
    style: str


def dot_chart(dots: Sequence[Dot], axis_name: str, band: Range | None = None) -> Markup:
    """Named values, one a row, on a common axis with ticks at whole numbers.

    Args:
        band: low and high end of a shaded range, for a tolerance.
    """
    values = [one.value for one in dots]
    axis = nice_axis(math.floor(min(values) - 0.5), math.ceil(max(values) + 0.5), 8, tight=True)
    return html("dot_chart.html.j2", axis=axis.whole(), dots=dots, axis_name=axis_name, band=band)


def colour_bar(table: Table, axis: ChartAxis, name: str) -> Markup:
    """The legend of a map: colours along the axis, ticks, and the name of the quantity with its unit."""
    sign = "+" if axis.low < 0.0 < axis.high else ""
    return html("colour_bar.html.j2", picture=bar_uri(table), axis=axis, sign=sign, name=name)


def signed_bar(limit: float, name: str) -> Markup:
    """The legend of a map of values from -`limit` to `limit`."""
    return colour_bar(PURPLE_ORANGE, signed_axis(limit), name)


@dataclass(frozen=True)
class Profile:
    """Heights whose rows a chart shows, one at a time.

    Attributes:
        heights: (rows, cols), mm.
        size_mm: side of the plate.
    """

    heights: FloatArray
    size_mm: float

    def path(self, row: int, top_mm: float) -> str:
        """One row as SVG path data in mm, y downward from the height `top_mm`."""
        heights = self.heights[row]
        xs = (np.arange(len(heights)) + 0.5) * self.size_mm / len(heights)
        return "M" + "L".join(f"{x:.3f} {top_mm - z:.3f}" for x, z in zip(xs, heights, strict=True))

    @property
    def micrometres(self) -> str:
        """Heights as base64 of little-endian int16 in micrometres, for the script of the page."""
        counts = np.clip(np.rint(np.asarray(self.heights) * 1000.0), -32768, 32767)
        return base64.b64encode(counts.astype("<i2").tobytes()).decode("ascii")
