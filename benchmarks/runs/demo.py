"""The demo runs as a table, from the document of their study.

retouch study demo -o runs/demo && cp runs/demo/study.json benchmarks/results/studies/demo.json
"""

from __future__ import annotations

from benchmarks.shared.common import table
from benchmarks.shared.finished_studies import Row, committed

METHODS = ("scaled", "still shadows", "Retouch")


def rows_of(name: str) -> list[Row]:
    """The rows of a table of the study that are done."""
    return committed("demo", name)


def case(row: Row) -> str:
    """Texture and target of a row."""
    return f"{row['texture']} {row['touch.jnd']:+d} JND"


def as_text() -> str:
    """Change of the pictures by each method, mean / rms in % of the mean picture; Adam's beside them."""
    lines = []
    for name in dict.fromkeys(map(case, rows_of("methods"))):
        found = {str(row["method"]): row for row in rows_of("methods") if case(row) == name}
        found |= {f"Adam, {row['shadows']}": row for row in rows_of("Adam") if case(row) == name}
        ours = found["Retouch"]
        cells = (_change(found[key]) for key in (*METHODS, "Adam, moving", "Adam, still"))
        lines.append([name, *cells, f"{ours['miss_percent']:.2f}", ours["steps"], f"{ours['cpu_s']:.1f}"])
    heads = ("scaled", "without the visibility term", "Retouch", "Adam", "Adam without the visibility term")
    return table(("target", *heads, "off target, %", "steps", "CPU s"), lines)


def _change(row: Row) -> str:
    return f"{row['change_percent']:.1f} / {row['change_rms_percent']:.1f}"
