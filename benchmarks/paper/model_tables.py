"""Tables of studies in few numbers: medians over textures and targets, by what steered."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, log
from statistics import fmean, median
from typing import Any

from benchmarks.paper.study_rows import rows_of
from retouch.laboratory.studies.plots import interval

COLUMNS = (
    *("change_percent", "change_rms_percent", "change_lights_percent", "dssim"),
    *("jod", "miss_percent", "steps", "cpu_s"),
)
"""Columns whose medians are reported."""
COMPARED = ("change_percent", "change_rms_percent", "change_lights_percent", "dssim", "cpu_s")
"""Columns whose mean ratio to the first value of the axis is reported."""
FEWEST = 5
"""Fewest textures for an interval; the range of fewer textures is reported."""
KNOWN = 0.9
"""Least part of the rows that a median needs numbers of: a row that was continued has no CPU seconds."""
MET_PERCENT = 1.0
"""Error of the verified target that counts as met, the tolerance of the runs."""


def looks() -> dict[str, Any]:
    """Figure 10: steered by pictures with and without shadows and ambient occlusion."""
    return by(rows_of("figure10"), "look.model")


def contact() -> dict[str, Any]:
    """Figures 14 and 17: 0.7 and 1.4 times the contact area, optimised and scaled."""
    return by(rows_of("figure17"), "descent.method")


def surrogate() -> dict[str, Any]:
    """Exact and surrogate models, table by table."""
    rows = rows_of("exact-vs-surrogate")
    axes = {"look": "look", "touch": "touch.model", "method": "descent.method"}
    return {name: by([row for row in rows if row["table"] == name], axis) for name, axis in axes.items()}


def by(rows: Sequence[dict[str, Any]], axis: str) -> dict[str, Any]:
    """Numbers of rows, of targets met, medians and ratios, for each value of an axis.

    The medians run over the textures and targets that have a row for every value. A ratio is the geometric
    mean, over textures, of that to the row of the same texture and target and the first value of the axis,
    where both meet the target. Beside it stands its 95 % interval, for which textures are drawn, or the range
    of fewer than `FEWEST` textures.
    """
    values = list(dict.fromkeys(row[axis] for row in rows))
    cases = [{_case(row) for row in rows if row[axis] == value} for value in values]
    shared = set.intersection(*cases) if cases else set()
    found = {}
    first = {_case(row): row for row in rows if row[axis] == values[0]} if values else {}
    for value in values:
        each = [row for row in rows if row[axis] == value and _case(row) in shared]
        compared = [row for row in each if _met(row) and _met(first[_case(row)])]
        found[str(value)] = {
            "rows": len(each),
            "met": sum(map(_met, each)),
            **{
                name: median(numbers) if numbers and len(numbers) >= KNOWN * len(each) else None
                for name in COLUMNS
                for numbers in [[row[name] for row in each if row.get(name) is not None]]
            },
            "ratios": {
                name: ratio
                for name in COMPARED
                if (ratio := _ratio(name, compared, first)) and value != values[0]
            },
        }
    return found


def _ratio(name: str, rows: Sequence[dict[str, Any]], first: dict[Any, dict[str, Any]]) -> list[float] | None:
    """Mean ratio of a column to that of the first rows, with the ends of its interval; None: no numbers."""
    by_texture: dict[str, list[float]] = {}
    for row in rows:
        one, other = row.get(name), first[_case(row)].get(name)
        if one and other:
            by_texture.setdefault(row["texture"], []).append(log(one / other))
    means = [fmean(logs) for logs in by_texture.values()]
    if not means:
        return None
    ends = interval(means) if len(means) >= FEWEST else (min(means), max(means))
    return [exp(number) for number in (fmean(means), *ends)]


def _met(row: dict[str, Any]) -> bool:
    return row["miss_percent"] is not None and row["miss_percent"] <= MET_PERCENT


def _case(row: dict[str, Any]) -> tuple[Any, ...]:
    """Texture and target of a row."""
    return row["texture"], row.get("touch.jnd"), row.get("touch.contact_area_scale")
