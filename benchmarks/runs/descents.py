"""Whole runs on the demo textures: ways down, with and without the shadow-edge term, beside linear scaling.

python -m benchmarks.runs.descents     # prints the table

The runs are the study `descents.toml` beside this file: `retouch study benchmarks/runs/descents.toml`. The
table is that of results/runs.json, which a script has measured along the same descents (at commit 340f9f0),
with pictures at two resolutions and the curve of every descent. It is not measured anew.
"""

from __future__ import annotations

from typing import Any

from benchmarks.shared.common import load, table

RESOLUTIONS = (128, 256)
"""Pixels along the film of the pictures that are compared."""

NOTES = """\
Picture change: pictures by Mitsuba with the same random numbers before and after, at 128 and 256 pixels,
64 samples a pixel, less noise. V: layer model, float64, all offsets; targets within 1 %. Seconds: the
descent alone, without loading and verification. Adam: w1 = 0.1, 100 steps; smoothed: lambda 100, 0.05 mm, 40
steps; CPU seconds, as other work ran beside. % of white: of the radiance of a white
plate that faces the light, as the paper's % of pixel values."""


def as_table(rows: dict[str, Any]) -> str:
    """All cases as one table."""
    head = (
        *("texture and JND", "method", "V off target %", "heights mm", "steps", "s"),
        *(
            "128 px: mean % of mean",
            "rms",
            "mean % of white",
            "256 px: mean % of mean",
            "rms",
            "mean % of white",
        ),
    )
    lines = []
    for key, row in rows.items():
        case, way = key.split(", ", 1)
        if "pictures" not in row:
            lines.append((case, way, row["reason"], *[None] * 9))
            continue
        changes = []
        for resolution in RESOLUTIONS:
            c = row["pictures"][str(resolution)]
            changes += [c["mean_percent_of_mean"], c["rms_percent_of_mean"], c["mean_percent_of_white"]]
        span = f"{row['min_mm']:.2f}-{row['max_mm']:.2f}"
        seconds = row["cpu_seconds" if way.startswith("adam") else "seconds"]
        lines.append((case, way, f"{row['miss_percent']:+.2f}", span, row["steps"], seconds, *changes))
    return table(head, lines)


def main() -> None:
    print(as_table(load("runs")["rows"]))


if __name__ == "__main__":
    main()
