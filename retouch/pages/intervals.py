"""Charts of means with intervals: lines over numbers, or a row for each word.

Marks and labels are made as in `retouch.pages.svg`.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from retouch.pages import svg

COLOURS = 6
"""Number of CSS classes `s0`, `s1`, ... of series. Further series have the same colours with hollow marks and
dashes, by the class `more`."""
DODGE = 0.012
"""Distance of the marks of two series at one place, as a share of the axis."""


@dataclass(frozen=True)
class Mean:
    """A mean with its interval.

    Attributes:
        place: where the mean stands on the other axis: a number, or the place of a word in its list.
        value: the mean.
        low, high: ends of the interval; both the mean if there is none.
        count: of what the mean is of.
    """

    place: float
    value: float
    low: float
    high: float
    count: int


@dataclass(frozen=True)
class Means:
    """A series.

    Attributes:
        name: may be empty.
        means: in any order.
        through: place and value of a point that the line of the means goes through without a mark; None if
            there is none.
        marked: whether a line chart marks the means; a series without marks lies where its places say.
    """

    name: str
    means: Sequence[Mean]
    through: tuple[float, float] | None = None
    marked: bool = True


def line_chart(title: str, series: Sequence[Means], x_name: str) -> Markup:
    """Means over numbers, joined by lines; a vertical line is the interval."""
    points = [mean for one in series for mean in one.means]
    xs, ys = [mean.place for mean in points], [end for mean in points for end in (mean.low, mean.high)]
    margin = 0.06 * (max(xs) - min(xs) or 1.0)
    x_axis = svg.nice_axis(min(xs) - margin, max(xs) + margin, 6, tight=True)
    y_axis = svg.nice_axis(min([0.0, *ys]), max([0.0, *ys]), 4)
    marks = [_path("grid", [(0, _down(y_axis, tick)), (100, _down(y_axis, tick))]) for tick in y_axis.ticks]
    marked = [one for one in series if one.marked]
    for number, one in enumerate(series):
        shift = 100.0 * DODGE * (number - 0.5 * (len(marked) - 1)) if one.marked else 0.0
        style = _style(number)
        placed = [(x_axis.percent(mean.place) + shift, mean) for mean in one.means]
        line = sorted(
            [(mean.place, mean.value) for mean in one.means] + ([] if one.through is None else [one.through])
        )
        marks.append(_path(style, [(x_axis.percent(x) + shift, _down(y_axis, y)) for x, y in line]))
        for x, mean in placed:
            if mean.high > mean.low:
                ends = [(x, _down(y_axis, end)) for end in (mean.low, mean.high)]
                marks.append(_path(f"{style} interval", ends))
            if one.marked:
                # A line of length 0 with round ends stays a circle when the drawing is stretched.
                marks.append(_path(f"{style} dot", [(x, _down(y_axis, mean.value))] * 2))
    labels = [
        Markup('<span class="tick y" style="bottom:{:.2f}%">{}</span>').format(
            y_axis.percent(t), y_axis.label(t)
        )
        for t in y_axis.ticks
    ]
    return Markup(
        '<div class="chart means" role="img" aria-label="{0}"><div class="chart-title">{0}</div>{1}'
        '<div class="plot"><svg viewBox="0 0 100 100" preserveAspectRatio="none" aria-hidden="true">{2}</svg>'
        '{3}</div><div class="x-name">{4}</div></div>'
    ).format(title, _legend(series), _join(marks), _join([*labels, _x_ticks(x_axis)]), x_name)


def row_chart(title: str, series: Sequence[Means], words: Sequence[str], axis_name: str) -> Markup:
    """Means of words, a row each; a horizontal line is the interval."""
    ends = [end for one in series for mean in one.means for end in (mean.low, mean.high)]
    axis = svg.nice_axis(min([0.0, *ends]), max([0.0, *ends]), 5)
    lines = _join(
        Markup('<i class="grid{}" style="left:{:.2f}%"></i>').format(
            "" if tick else " zero", axis.percent(tick)
        )
        for tick in axis.ticks
    )
    rows = []
    for place, word in enumerate(words):
        marks = [
            _marks(axis, mean, number, len(series))
            for number, one in enumerate(series)
            for mean in one.means
            if mean.place == place
        ]
        rows.append(
            Markup(
                '<div class="name" style="grid-row:{0}">{1}</div>'
                '<div class="track" style="grid-row:{0}">{2}</div>'
            ).format(place + 1, word, _join(marks))
        )
    return Markup(
        '<div class="chart means" role="img" aria-label="{0}"><div class="chart-title">{0}</div>{1}'
        '<div class="dots"><div class="lines" style="grid-row:1/{2}">{3}</div>{4}<div class="scale">{5}'
        '<div class="x-name">{6}</div></div></div></div>'
    ).format(title, _legend(series), len(words) + 1, lines, _join(rows), _x_ticks(axis), axis_name)


def _marks(axis: svg.ChartAxis, mean: Mean, number: int, count: int) -> Markup:
    """A mean of a row chart: the series of a row lie below one another."""
    top = 100.0 * (number + 1) / (count + 1)
    interval = Markup("")
    if mean.high > mean.low:
        left, right = axis.percent(mean.low), axis.percent(mean.high)
        line = Markup('<i class="interval" style="left:{:.2f}%;width:{:.2f}%"></i>')
        interval = line.format(left, right - left)
    dot = Markup('<i class="mark" style="left:{:.2f}%"></i>').format(axis.percent(mean.value))
    style = _style(number)
    return Markup('<div class="{}" style="top:{:.1f}%">{}{}</div>').format(style, top, interval, dot)


def _legend(series: Sequence[Means]) -> Markup:
    """Names of the series; nothing if none has a name."""
    if not any(one.name for one in series):
        return Markup("")
    names = _join(
        Markup('<span class="{}"><i></i>{}</span>').format(_style(number), one.name)
        for number, one in enumerate(series)
    )
    return Markup('<div class="series">{}</div>').format(names)


def _style(number: int) -> str:
    """CSS classes of a series."""
    return f"s{number % COLOURS}" + (" more" if number // COLOURS % 2 else "")


def _down(axis: svg.ChartAxis, value: float) -> float:
    return 100.0 - axis.percent(value)


def _path(style: str, points: Sequence[tuple[float, float]]) -> Markup:
    data = "M" + "L".join(f"{x:.3f} {y:.3f}" for x, y in points)
    return Markup('<path class="{}" d="{}"/>').format(style, data)


def _x_ticks(axis: svg.ChartAxis) -> Markup:
    return _join(
        Markup('<span class="tick x{}" style="left:{:.2f}%">{}</span>').format(
            axis.side(tick), axis.percent(tick), axis.label(tick)
        )
        for tick in axis.ticks
        if math.isfinite(tick)
    )


def _join(parts: object) -> Markup:
    return Markup("").join(parts)  # type: ignore[arg-type]
