"""Run time against error of whole runs: every way down and every model that steers, step by step.

retouch study benchmarks/runs/pareto.toml -o runs/pareto --workers 1     # about a quarter of an hour
python -m benchmarks.runs.pareto runs/pareto     # reads the runs of the study
python -m benchmarks.runs.pareto                 # draws docs/images/pareto.png again, writes the tables

Only results are rendered and verified by finite elements. Of each step before, this is estimated: what the
models that steer say of the step, times the ratio of both for the result.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from matplotlib import pyplot
from matplotlib.axes import Axes

from benchmarks.shared.chart_style import FAINT, INK, frame, style, write
from benchmarks.shared.common import DOCS, IMAGES, load, machine, publish, save, study_given, table
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from optimize.run_directory.history import HISTORY
from optimize.run_directory.key import RESULT

PAGE = DOCS / "evidence" / "speed.md"
PICTURE = IMAGES / "pareto.png"
TOLERANCE = 1.0
"""Relative error up to which a target counts as met, %."""
WITHIN = (10, 5, 2)
"""Distances from the smallest change of the pictures that is known, %, of the columns of seconds."""
FLOOR, CEILING = 0.5, 3000.0
"""Ends of the axis of such distances, %; the smallest change itself is drawn at the lower one."""
SECONDS, ABOVE = (3, 5, 10, 20, 50, 100), (1, *reversed(WITHIN), 30, 100, 300, 1000)
"""Ticks of the axes: CPU seconds, and distances from the smallest change, %."""


class Look(NamedTuple):
    """How a way is drawn."""

    colour: str
    mark: str
    line: str = "-"


WAYS: Mapping[str, Look] = {
    "scaling": Look(FAINT, "x"),
    "gauss-newton, layer, exact": Look("#2d6a8e", "o"),
    "gauss-newton, quick, exact": Look("#2d6a8e", "s", "--"),
    "gauss-newton, net, exact": Look("#2d6a8e", "^", ":"),
    "gauss-newton, layer, fast": Look("#c4532d", "o"),
    "gauss-newton, quick, fast": Look("#c4532d", "s", "--"),
    "gauss-newton, net, fast": Look("#c4532d", "^", ":"),
    "adam, layer, exact": Look("#b8860b", "o"),
    "adam smoothed, layer, exact": Look("#6f8f3a", "o"),
    "adam smoothed, quick, fast": Look("#6f8f3a", "s", "--"),
    "adam smoothed, long, quick, fast": Look("#7b5ea7", "s", "--"),
}
"""Ways of the study: method, model of touch, model of pictures."""


def main() -> None:
    study = study_given(__doc__)
    if study is not None:
        found = {f"{row['case']}: {row['way']}": measured(study, row) for row in rows_in(study)}
        save("pareto", {"machine": machine(), "rows": found})
    rows = load("pareto")["rows"]
    draw(rows)
    publish(PAGE, "pareto", "benchmarks.runs.pareto", as_text(rows))


def measured(study: Path, row: Row) -> dict[str, Any]:
    """A run of the study: its result, and what its steps had come to by which CPU seconds."""
    folder = folder_of(study, row)
    result = json.loads((folder / RESULT).read_text(encoding="utf-8"))
    history = [json.loads(line) for line in (folder / HISTORY).read_text(encoding="utf-8").splitlines()]
    return {
        "case": row["case"],
        "way": row["way"],
        **{
            key: row[key]
            for key in ("reason", "steps", "miss_percent", "change_percent", "change_rms_percent")
        },
        "change_fine_rms_percent": row.get("change_fine_rms_percent"),
        "cpu_s": result["cpu_s"],
        "curve": curve(result, history),
    }


def curve(result: Mapping[str, Any], history: list[dict[str, Any]]) -> list[tuple[float, float, float]]:
    """CPU seconds of a run that ends at each step, distance to the target and picture change, both %.

    Seconds are those of the descent up to the step, and of the verification and the final pictures.
    """
    touch, cpu = result["touch"], result["cpu_s"]
    (last,) = [row for row in history if row["step"] == result["stop"]["best_step"]][-1:]
    felt = touch["verified_roughness"] / last["roughness"]
    seen = result["look"]["change_percent"] / last["picture_mean_percent"]
    pace = cpu["descent"] / max(result["time_s"]["descent"], 1e-9)
    return [
        (
            cpu["verify"] + pace * row["seconds"],
            100.0 * abs(felt * row["roughness"] / touch["target_roughness"] - 1.0),
            seen * row["picture_mean_percent"],
        )
        for row in history
        if row["step"] > 0
    ]


def best_known(rows: Mapping[str, Row], case: str) -> float:
    """Smallest change of the pictures of any result of a case that meets its target, %."""
    met = [row for row in rows.values() if row["case"] == case and row["miss_percent"] <= TOLERANCE]
    return min(float(row["change_percent"]) for row in met)


def seconds_of(row: Row) -> float:
    """CPU seconds of descent and verification."""
    return float(row["cpu_s"]["descent"] + row["cpu_s"]["verify"])


def seconds_to(row: Row, change_percent: float) -> float:
    """CPU seconds to the first step on target with at most so much change; NaN if there is none."""
    steps = (s for s, error, change in row["curve"] if error <= TOLERANCE and change <= change_percent)
    return next(steps, math.nan)


def as_text(rows: Mapping[str, Row]) -> str:
    """Seconds to some distances from the smallest change, and the results, of every case and way."""
    lines = []
    for case in dict.fromkeys(row["case"] for row in rows.values()):
        best = best_known(rows, case)
        for way in WAYS:
            row = rows.get(f"{case}: {way}")
            if row is None:
                continue
            to = [seconds_to(row, (1.0 + within / 100.0) * best) for within in WITHIN]
            lines.append(
                (
                    *(case, way, *(None if math.isnan(each) else each for each in to)),
                    *(row["steps"], seconds_of(row), row["miss_percent"]),
                    *(row["change_percent"], 100.0 * (row["change_percent"] / best - 1.0)),
                    *(row["change_rms_percent"], row["change_fine_rms_percent"]),
                )
            )
    head = (
        *("case", "way", *(f"within {within} %, CPU s" for within in WITHIN)),
        *("steps", "to the end, CPU s", "off target, %"),
        *("pictures, %", "above the best, %", "rms, %", "rms at twice the resolution, %"),
    )
    return table(head, lines)


def draw(rows: Mapping[str, Row]) -> None:
    """Write the picture."""
    style()
    cases = list(dict.fromkeys(row["case"] for row in rows.values()))
    figure, axes = pyplot.subplots(
        1, len(cases), figsize=(10.5, 5.2), sharex=True, sharey=True, squeeze=False, layout="constrained"
    )
    for axis, case in zip(axes[0], cases, strict=True):
        of_case(axis, rows, case)
    axes[0, 0].set_ylabel("picture change above the smallest known, %")
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=3, frameon=False)
    write(figure, PICTURE, dpi=160)


def of_case(axis: Axes, rows: Mapping[str, Row], case: str) -> None:
    """One panel: of every way the smallest change so far with the target met, and its result."""
    best = best_known(rows, case)
    for within in WITHIN:
        axis.axhline(within, color=FAINT, linewidth=0.8, linestyle=":", zorder=0)
    for way, (colour, mark, line) in WAYS.items():
        row = rows.get(f"{case}: {way}")
        if row is None:
            continue
        seconds, above = list[float](), list[float]()
        for second, error, change in row["curve"]:
            distance = 100.0 * (change / best - 1.0)
            if error <= TOLERANCE and (not above or distance < above[-1]):
                seconds.append(second)
                above.append(max(distance, FLOOR))
        axis.step(seconds, above, where="post", color=colour, linestyle=line, linewidth=1.1)
        result = max(100.0 * (row["change_percent"] / best - 1.0), FLOOR)
        (end,) = axis.plot([seconds_of(row)], [result], mark, color=colour, linestyle=line, label=way)
        end.set_clip_on(False)
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xticks(SECONDS, [str(each) for each in SECONDS])
    axis.set_yticks(ABOVE, [str(each) for each in ABOVE])
    axis.minorticks_off()
    axis.set_ylim(FLOOR, CEILING)
    axis.set_title(
        f"{case} JND: {best:.2f} % is the smallest change known", fontsize=9, color=INK, loc="left"
    )
    axis.set_xlabel("CPU seconds of descent and verification")
    frame(axis)


if __name__ == "__main__":
    main()
