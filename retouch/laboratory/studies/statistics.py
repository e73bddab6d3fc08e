"""Means with bootstrap intervals, of the rows of a table."""

from collections.abc import Mapping, Sequence

import numpy as np

from retouch.laboratory.studies.records import Cell
from retouch.pages.intervals import Mean

RESAMPLES, LEVEL, SEED = 4000, 95.0, 0
"""Resamples of the bootstrap, its level in percent, and the seed of its random numbers."""

RowCells = Mapping[str, Cell]


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
