"""Plots of a study: means of a column over an axis, a series for each value of another axis."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from markupsafe import Markup

from retouch.laboratory.studies.columns import UNCHANGED, ZERO_UNCHANGED, heading
from retouch.laboratory.studies.document import StudyDocument, TableOfDocument, flat_rows
from retouch.laboratory.studies.records import Cell
from retouch.laboratory.studies.study_file import Plot, label_text
from retouch.pages.intervals import Mean, Means, line_chart, row_chart

DEFAULT_COLUMNS = ("change_percent", "miss_percent")
"""Columns that are drawn where the study file names no plot."""
RESAMPLES, LEVEL, SEED = 4000, 95.0, 0
"""Resamples of the bootstrap, its level in percent, and the seed of its random numbers."""
THROUGH = "Lines go through 0 where nothing is changed, which needs no run."
"""Sentence about lines with a point that has no mark."""
MOST_SERIES = 6
"""Most values of an axis that become series where the study file does not ask for them."""

RowCells = Mapping[str, Cell]


def charts(content: StudyDocument) -> tuple[list[Markup], str]:
    """The plots that the study file asks for, or those that its axes suggest, and a note for all of them."""
    points, most, through = [], 0, False
    for table in content.tables:
        rows = [row for row in flat_rows(content) if row["table"] == table.name]
        plots = [plot for plot in content.plots if plot.table in (None, table.name)]
        for plot in plots if content.plots else _suggested(table):
            chart = _chart(plot, table, rows, len(content.tables) > 1)
            if chart is not None:
                points.append(chart[0])
                most, through = max(most, chart[1]), through or chart[2]
    words = note(content) if most > 1 else "Each point is of a single row, without an interval."
    return points, f"{words} {THROUGH}" if through else words


def _suggested(table: TableOfDocument) -> Iterator[Plot]:
    """Plots over the last axis of numbers, or else the longest axis."""
    axes = {axis: values for axis, values in table.axes.items() if len(values) > 1}
    if not axes:
        return
    numbers = [axis for axis, values in axes.items() if _numbers(values)]
    x = numbers[-1] if numbers else max(axes, key=lambda axis: len(axes[axis]))
    by = [axis for axis, values in axes.items() if axis != x and len(values) <= MOST_SERIES]
    for column in DEFAULT_COLUMNS:
        yield Plot(x=x, y=column, by=by[-1] if by else None)


def _chart(
    plot: Plot, table: TableOfDocument, rows: Sequence[RowCells], named: bool
) -> tuple[Markup, int, bool] | None:
    """A plot of a table, the most numbers that a point is the mean of, and whether a line goes through 0.

    None if the table lacks an axis of the plot or has no number.
    """
    needed = {axis for axis in (plot.by, plot.over) if axis is not None}
    if not needed <= table.axes.keys():
        return None
    places = table.axes.get(plot.x)
    numeric = places is None or _numbers(places)
    series = []
    for value in [None] if plot.by is None else table.axes[plot.by]:
        mine = [row for row in rows if plot.by is None or row[plot.by] == value]
        means: list[Mean | None] = []
        if places is None:
            # A column: one point, the means of both.
            across = mean_over(mine, plot.x, plot.over, 0.0)
            means = [] if across is None else [mean_over(mine, plot.y, plot.over, across.value)]
        for number, place in enumerate(places or ()):
            at = float(place) if numeric and isinstance(place, int | float) else float(number)
            means.append(mean_over([row for row in mine if row[plot.x] == place], plot.y, plot.over, at))
        points = [mean for mean in means if mean is not None]
        if points:
            name = "" if plot.by is None else label_text(value)
            series.append(Means(name, points, _unchanged(plot, points) if numeric else None))
    if not series:
        return None
    title = f"{table.name}: {heading(plot.y)}" if named else heading(plot.y)
    title = title[:1].upper() + title[1:]
    most = max(mean.count for one in series for mean in one.means)
    if places is None or numeric:
        through = any(one.through is not None for one in series)
        return line_chart(title, series, heading(plot.x)), most, through
    return row_chart(title, series, [label_text(place) for place in places], heading(plot.y)), most, False


def _unchanged(plot: Plot, points: Sequence[Mean]) -> tuple[float, float] | None:
    """The point of a plot where nothing is changed, if the plot reaches beyond on both sides."""
    at = UNCHANGED.get(plot.x)
    if at is None or plot.y not in ZERO_UNCHANGED:
        return None
    places = [point.place for point in points]
    return (at, 0.0) if min(places) < at < max(places) and at not in places else None


def _numbers(values: Sequence[Cell]) -> bool:
    return all(isinstance(value, int | float) and not isinstance(value, bool) for value in values)


def note(content: StudyDocument) -> str:
    """What means and intervals of the plots are of, in a sentence."""
    over = {plot.over for plot in content.plots}
    drawn = f"values of {', '.join(sorted(filter(None, over)))}" if over - {None} else "rows"
    return (
        f"Points are means over {drawn}; lines beside them are 95 % intervals of the mean, "
        f"drawn anew from the same {drawn} 4000 times (bootstrap)."
    )


def interval(values: Sequence[float]) -> tuple[float, float]:
    """Ends of the percentile bootstrap interval of a mean (Efron 1979); of one value, both that value."""
    sample = np.asarray(values, dtype=np.float64)
    if len(sample) < 2:
        return float(sample.mean()), float(sample.mean())
    drawn = np.random.default_rng(SEED).integers(len(sample), size=(RESAMPLES, len(sample)))
    low, high = np.percentile(sample[drawn].mean(axis=1), [50.0 - LEVEL / 2.0, 50.0 + LEVEL / 2.0])
    return float(low), float(high)


def mean_over(rows: Sequence[RowCells], column: str, over: str | None, place: float) -> Mean | None:
    """The mean of a column over rows, with its interval; None if no row has a number.

    Args:
        rows: the rows.
        column: of the numbers.
        over: axis whose values the bootstrap draws, each with the mean of its rows; None: it draws rows.
        place: of the mean in its chart.
    """
    groups: dict[object, list[float]] = {}
    for number, row in enumerate(rows):
        value = row.get(column)
        if isinstance(value, int | float) and not isinstance(value, bool):
            groups.setdefault(number if over is None else row.get(over), []).append(float(value))
    if not groups:
        return None
    values = [float(np.mean(group)) for group in groups.values()]
    return Mean(place, float(np.mean(values)), *interval(values), len(values))
