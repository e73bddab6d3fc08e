"""docs/measured.md and the table of the README, from the results of the other benchmarks.

python -m benchmarks.measured
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks import gradients, runs
from benchmarks.common import load, table

DOC = Path("docs/measured.md")


README = Path("README.md")
TABLE = (
    "<!-- table of measured results, made by python -m benchmarks.measured -->\n",
    "<!-- end of the table -->",
)


def main() -> None:
    readme = README.read_text(encoding="utf-8")
    start, rest = readme.split(TABLE[0], 1)
    README.write_text(start + TABLE[0] + _summary() + TABLE[1] + rest.split(TABLE[1], 1)[1], encoding="utf-8")
    parts = ["# What was measured, and how?\n", _machine(), _runs(), _gradients(), _touch()]
    DOC.write_text("\n".join(parts), encoding="utf-8")
    print(DOC)


def _summary() -> str:
    """One row for each texture and target: what a reader wants to know first."""
    rows, lines = load("runs")["rows"], []
    for case in dict.fromkeys(key.split(", ", 1)[0] for key in rows):
        line: list[Any] = [case.replace("+", " +").replace("-", " -") + " JND"]
        for way in ("linear scaling", "gauss-newton, no edges", "gauss-newton"):
            row = rows.get(f"{case}, {way}", {})
            change = row.get("pictures", {}).get("128")
            line.append(
                row.get("reason")
                if change is None
                else f"{change['mean_percent_of_mean']:.1f} / {change['rms_percent_of_mean']:.1f}"
            )
        ours = rows[f"{case}, gauss-newton"]
        lines.append([*line, f"{abs(ours['miss_percent']):.2f}", f"{ours['seconds']:.0f}"])
    head = (
        *("texture and target", "scaled in height", "without shadow edges", "Retouch"),
        *("off target, %", "seconds"),
    )
    return table(head, lines) + "\n"


def _machine() -> str:
    machine = load("runs")["machine"]
    return (
        f"Everything here was measured on {machine['cores']} cores of {machine['cpu']}, without a GPU, and "
        "is repeated by the command named with it; the numbers stand in `benchmarks/results/`. This page is "
        "made from them by `python -m benchmarks.measured`.\n"
    )


def _runs() -> str:
    return f"""## Whole runs

`python -m benchmarks.runs`. {runs.NOTES}

{runs.as_table(load("runs")["rows"])}

{_ratios(load("runs")["rows"])}
"""


def _ratios(rows: dict[str, Any]) -> str:
    """How many times less the pictures change by Gauss-Newton than otherwise, at the film's resolution."""
    lines = []
    for case in dict.fromkeys(key.split(", ", 1)[0] for key in rows):
        ours = rows[f"{case}, gauss-newton"].get("pictures")
        line: list[Any] = [case]
        for other, kind in (("linear scaling", "mean"), ("gauss-newton, no edges", "rms"), ("adam", "rms")):
            theirs = rows.get(f"{case}, {other}", {}).get("pictures")
            for resolution in map(str, runs.RESOLUTIONS):
                key = f"{kind}_percent_of_mean"
                line.append(
                    None if not (ours and theirs) else theirs[resolution][key] / ours[resolution][key]
                )
        lines.append(line)
    head = (
        "texture and JND",
        "linear scaling, mean, 128",
        "256",
        "no edges, rms, 128",
        "256",
        "adam, rms, 128",
        "256",
    )
    return "Picture change of other ways divided by that of gauss-newton:\n\n" + table(head, lines)


def _gradients() -> str:
    return f"""## Gradients of pictures

`python -m benchmarks.gradients`. {gradients.NOTES}

{gradients.as_table(load("gradients")["rows"])}
"""


def _touch() -> str:
    touch = load("touch")
    parts = [
        "## Touch\n\n`python -m benchmarks.touch`: 128 x 128 heights, medians.\n",
        table(("what", "threads", "float32 ms", "float64 ms"), [list(r.values()) for r in touch["times_ms"]]),
        "\nSteps of the contact solver to its default tolerance (2e-5 and 1e-9 of the mean displacement):\n",
        table(
            ("smoothness px", "relief mm", "float32", "float64", "contact fraction"),
            [list(s.values()) for s in touch["steps"]],
        ),
        "\nV by the coarse mesh of the free-sides correction, against 48 elements a side, same reliefs:\n",
        table(
            ("elements a side", "median off %", "worst off %"), [list(c.values()) for c in touch["coarse"]]
        ),
        "",
    ]
    return "\n".join(parts)


if __name__ == "__main__":
    main()
