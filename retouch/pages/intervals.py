"""Charts of means with intervals: lines over numbers, or a row for each word.

Marks and labels are made as in `retouch.pages.svg`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from markupsafe import Markup

from relief.ground.arrays import Array
from retouch.pages import svg
from retouch.pages.templates import html

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

    @classmethod
    def curve(cls, name: str, places: Array, values: Array) -> Self:
        """A curve through values (n,) at places (n,), without marks and intervals."""
        each = zip(places.tolist(), values.tolist(), strict=True)
        return cls(name, [Mean(place, value, value, value, 0) for place, value in each], marked=False)


def line_chart(title: str, series: Sequence[Means], x_name: str) -> Markup:
    """Means over numbers, joined by lines; a vertical line is the interval."""
    points = [mean for one in series for mean in one.means]
    xs, ys = [mean.place for mean in points], [end for mean in points for end in (mean.low, mean.high)]
    margin = 0.06 * (max(xs) - min(xs) or 1.0)
    x_axis = svg.nice_axis(min(xs) - margin, max(xs) + margin, 6, tight=True)
    y_axis = svg.nice_axis(min([0.0, *ys]), max([0.0, *ys]), 4)
    marks = list[svg.Mark]()
    marked = [one for one in series if one.marked]
    for number, one in enumerate(series):
        shift = 100.0 * DODGE * (number - 0.5 * (len(marked) - 1)) if one.marked else 0.0
        style = _style(number)
        through = [] if one.through is None else [one.through]
        line = sorted([*((mean.place, mean.value) for mean in one.means), *through])
        marks.append((style, [(x_axis.percent(x) + shift, y_axis.down(y)) for x, y in line]))
        for mean in one.means:
            x = x_axis.percent(mean.place) + shift
            if mean.high > mean.low:
                marks.append((f"{style} interval", [(x, y_axis.down(end)) for end in (mean.low, mean.high)]))
            if one.marked:
                marks.append(svg.dot(style, x, y_axis.down(mean.value)))
    return svg.chart(title, marks, x_axis, y_axis, x_name, legend=_legend(series))


def row_chart(title: str, series: Sequence[Means], words: Sequence[str], axis_name: str) -> Markup:
    """Means of words, a row each; a horizontal line is the interval."""
    ends = [end for one in series for mean in one.means for end in (mean.low, mean.high)]
    return html(
        "row_chart.html.j2",
        title=title,
        axis=svg.nice_axis(min([0.0, *ends]), max([0.0, *ends]), 5),
        series=series,
        legend=_legend(series),
        words=words,
        axis_name=axis_name,
    )


def _legend(series: Sequence[Means]) -> list[tuple[str, str]]:
    """CSS classes and name of each series."""
    return [(_style(number), one.name) for number, one in enumerate(series)]


def _style(number: int) -> str:
    """CSS classes of a series."""
    return f"s{number % COLOURS}" + (" more" if number // COLOURS % 2 else "")
