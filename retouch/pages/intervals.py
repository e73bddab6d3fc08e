"""Charts of means with intervals: lines over numbers, or a row for each word.

Marks and labels are made as in `retouch.pages.svg`.
"""

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
    marks, labels = svg.grid(y_axis)
    marked = [one for one in series if one.marked]
    for number, one in enumerate(series):
        shift = 100.0 * DODGE * (number - 0.5 * (len(marked) - 1)) if one.marked else 0.0
        style = _style(number)
        through = [] if one.through is None else [one.through]
        line = sorted([*((mean.place, mean.value) for mean in one.means), *through])
        marks.append(svg.path(style, [(x_axis.percent(x) + shift, y_axis.down(y)) for x, y in line]))
        for mean in one.means:
            x = x_axis.percent(mean.place) + shift
            if mean.high > mean.low:
                ends = [(x, y_axis.down(end)) for end in (mean.low, mean.high)]
                marks.append(svg.path(f"{style} interval", ends))
            if one.marked:
                marks.append(svg.dot(style, x, y_axis.down(mean.value)))
    return svg.chart(title, marks, [*labels, *svg.ticks(x_axis)], x_name, _legend(series), " means")


def row_chart(title: str, series: Sequence[Means], words: Sequence[str], axis_name: str) -> Markup:
    """Means of words, a row each; a horizontal line is the interval."""
    ends = [end for one in series for mean in one.means for end in (mean.low, mean.high)]
    axis = svg.nice_axis(min([0.0, *ends]), max([0.0, *ends]), 5)
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
            ).format(place + 1, word, svg.join(marks))
        )
    return Markup(
        '<div class="chart means" role="img" aria-label="{0}"><div class="chart-title">{0}</div>{1}{2}</div>'
    ).format(title, _legend(series), svg.row_grid(axis, rows, axis_name))


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
    names = svg.join(
        Markup('<span class="{}"><i></i>{}</span>').format(_style(number), one.name)
        for number, one in enumerate(series)
    )
    return Markup('<div class="series">{}</div>').format(names)


def _style(number: int) -> str:
    """CSS classes of a series."""
    return f"s{number % COLOURS}" + (" more" if number // COLOURS % 2 else "")
