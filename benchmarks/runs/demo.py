"""The demo runs as tables, from the document of their study.

retouch study demo -o runs/demo && cp runs/demo/study.json benchmarks/results/studies/demo.json
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.shared.common import table
from benchmarks.shared.finished_studies import Row, committed

CHANGES = ("change_percent", "change_rms_percent")


def rows_of(name: str) -> list[Row]:
    """The rows of a table of the study that are done."""
    return committed("demo", name)


def case(row: Row) -> str:
    """Texture and target of a row."""
    return f"{row['texture']} {row['touch.jnd']:+d} JND"


def of_each(name: str, axes: Mapping[str, str]) -> str:
    """Every row of a table of the study; `axes` gives its own axes their headings."""
    columns = {
        "steps": "steps",
        "miss_percent": "off target, %",
        "change_percent": "pictures mean, %",
        "change_rms_percent": "rms, %",
        "change_percent_of_white": "% of white",
        "max_mm": "highest, mm",
        "cpu_s": "CPU seconds",
    }
    rows = rows_of(name)
    return table(
        (*axes.values(), *columns.values()), [[row.get(key) for key in (*axes, *columns)] for row in rows]
    )


def by_models() -> str:
    """Means over the six runs by the models that steer, and the pictures of each run."""
    rows = rows_of("models")
    models = list(dict.fromkeys(row["steered_by"] for row in rows))

    def mean(name: str, model: str) -> float:
        return float(np.mean([row[name] for row in rows if row["steered_by"] == model]))

    lines = [
        [
            model,
            sum(row["steps"] for row in rows if row["steered_by"] == model),
            *(mean(column, model) for column in ("cpu_s", "miss_percent", *CHANGES)),
        ]
        for model in models
    ]
    head = ("steered by", "steps, all", "CPU seconds", "off target, %", "pictures mean, %", "rms, %")
    of_case = [
        [
            name,
            *(
                f"{row['change_rms_percent']:.2f}"
                for m in models
                for row in rows
                if (case(row), row["steered_by"]) == (name, m)
            ),
        ]
        for name in dict.fromkeys(map(case, rows))
    ]
    return f"{table(head, lines)}\n\n{table(('pictures rms, %', *models), of_case)}"
