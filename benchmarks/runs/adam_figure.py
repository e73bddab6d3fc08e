"""Adam's descents over computing time, for docs/evidence/optimiser.md, from results/runs.json.

python -m benchmarks.runs.adam_figure          # draws docs/images/adam.png
"""

from __future__ import annotations

import math
from typing import Any

from matplotlib import pyplot

from benchmarks.shared.chart_style import FAINT, INK, frame, style, write
from benchmarks.shared.common import IMAGES, load, table

PATH = IMAGES / "adam.png"
WAYS = {
    "adam": ("#b8860b", "Adam, the paper's steps"),
    "adam, smoothed": ("#1f77b4", "Adam, smoothed metric"),
}
TIMES = (10, 20, 40, 60, 100)
"""Computing times of the table, CPU seconds."""
TOLERANCE = 1.0
"""Relative error up to which a target counts as met, %."""
ROBUST = 1.2
"""Multiple of Gauss-Newton's change that is aimed at."""

NOTES = """\
Columns of seconds: smallest change of the pictures of any step so far that met the target within 1 %, rms
in % of the mean picture, as the descent sees it (16 fixed samples a pixel). CPU seconds are of two
threads, about twice the seconds on two idle cores. Rendered: the result, by Mitsuba at 128 pixels. Dots:
steps that met the target."""

Row = dict[str, Any]


def cases(rows: dict[str, Row]) -> list[str]:
    """Textures and changes with a curve, in the order of the results."""
    names = dict.fromkeys(key.split(", ", 1)[0] for key in rows)
    return [name for name in names if any(rows.get(f"{name}, {way}", {}).get("curve") for way in WAYS)]


def after(row: Row, seconds: float) -> float:
    """Smallest rms change of the pictures with the target met, within these CPU seconds; NaN if not met."""
    met = [rms for cpu, error, rms in row["curve"] if cpu <= seconds and abs(error) <= TOLERANCE]
    return min(met, default=math.nan)


def as_table(rows: dict[str, Row]) -> str:
    """Change after some computing times, and at the end as rendered, in units of Gauss-Newton's."""
    head = (
        *("texture and JND", "method"),
        *(f"{seconds} s" for seconds in TIMES),
        *("CPU s", "rendered", "gauss-newton", "ratio"),
    )
    lines = []
    for case in cases(rows):
        best = rows[f"{case}, gauss-newton"]["pictures"]["128"]["rms_percent_of_mean"]
        for way, (_, name) in WAYS.items():
            row = rows.get(f"{case}, {way}", {})
            if not row.get("curve"):
                continue
            changes = [after(row, seconds) for seconds in TIMES]
            final = row["pictures"]["128"]["rms_percent_of_mean"]
            shown = [None if math.isnan(change) else change for change in changes]
            lines.append((case, name, *shown, row["cpu_seconds"], final, best, final / best))
    return table(head, lines)


def draw(rows: dict[str, Row]) -> None:
    """Write the picture."""
    style()
    names = cases(rows)
    figure, axes = pyplot.subplots(2, 3, figsize=(9.0, 5.0), sharex=True, squeeze=False, layout="constrained")
    for axis, case in zip(axes.ravel(), names, strict=False):
        frame(axis)
        axis.set_title(f"{case[:-2]} {case[-2:]} JND", fontsize=9, color=INK)
        goal = rows[f"{case}, gauss-newton"]["pictures"]["128"]["rms_percent_of_mean"]
        axis.axhline(goal, color=INK, linewidth=1.0, label="gauss-newton")
        axis.axhline(ROBUST * goal, color=FAINT, linewidth=0.8, linestyle=":", label="1.2 times that")
        for way, (colour, name) in WAYS.items():
            curve = rows.get(f"{case}, {way}", {}).get("curve", [])
            if not curve:
                continue
            met = [(cpu, rms) for cpu, error, rms in curve if abs(error) <= TOLERANCE]
            axis.plot([c for c, *_ in curve], [r for *_, r in curve], color=colour, linewidth=1.0, label=name)
            axis.plot([c for c, _ in met], [r for _, r in met], ".", color=colour, markersize=5)
        axis.set_ylim(0.0, 4.5 * goal)
    for axis in axes.ravel()[len(names) :]:
        axis.set_visible(False)
    for axis in axes[-1]:
        axis.set_xlabel("CPU seconds")
    for axis in axes[:, 0]:
        axis.set_ylabel("picture change, rms, %")
    axes[0, 0].legend(fontsize=7, frameon=False)
    write(figure, PATH, dpi=120)


def main() -> None:
    rows = load("runs")["rows"]
    draw(rows)
    print(as_table(rows))


if __name__ == "__main__":
    main()
