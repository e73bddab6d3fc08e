"""Tables of studies in few numbers: medians over textures and targets, by what steered."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median
from typing import Any

from benchmarks.paper.rows import rows_of

COLUMNS = (
    *("change_percent", "change_rms_percent", "change_lights_percent", "change_views_percent", "dssim"),
    *("miss_percent", "steps", "cpu_s"),
)
"""Columns whose medians are told."""
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
    axes = {
        "look": "look",
        "touch": "touch.model",
        "method": "descent.method",
        "scene": "scene",
        "one sun": "look.model",
    }
    found = {name: by([row for row in rows if row["table"] == name], axis) for name, axis in axes.items()}
    both = [
        row | {"models": f"{row['look']}, {row['touch.model']}"} for row in rows if row["table"] == "both"
    ]
    return found | {"both": by(both, "models")}


def by(rows: Sequence[dict[str, Any]], axis: str) -> dict[str, Any]:
    """Numbers of rows, of targets met, and medians, for each value of an axis.

    The medians run over the textures and targets that have a row for every value.
    """
    values = list(dict.fromkeys(row[axis] for row in rows))
    cases = [{_case(row) for row in rows if row[axis] == value} for value in values]
    shared = set.intersection(*cases) if cases else set()
    found = {}
    for value in values:
        each = [row for row in rows if row[axis] == value and _case(row) in shared]
        found[str(value)] = {
            "rows": len(each),
            "met": sum(
                row["miss_percent"] is not None and row["miss_percent"] <= MET_PERCENT for row in each
            ),
            **{
                name: median(numbers) if numbers and len(numbers) == len(each) else None
                for name in COLUMNS
                for numbers in [[row[name] for row in each if row.get(name) is not None]]
            },
        }
    return found


def _case(row: dict[str, Any]) -> tuple[Any, ...]:
    """Texture and target of a row."""
    return row["texture"], row.get("touch.jnd"), row.get("touch.contact_area_scale")
