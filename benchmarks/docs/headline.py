"""The table of the README: tiles by default settings, beside the same tiles scaled in height.

retouch study benchmarks/docs/headline.toml -o runs/headline
python -m benchmarks.docs.headline runs/headline
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.shared.common import ROOT, load, machine, put, save, study_given, table
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from optimize.run_directory.finished_run import read_verification

ROUGHER, SMOOTHER = "rougher", "smoother"


def main() -> None:
    study = study_given(__doc__)
    if study is not None:
        scaled = {_case(row): row["mean_change_percent_of_mean"] for row in rows_in(study, "scaled")}
        content: dict[str, Any] = {"machine": machine(), ROUGHER: {}, SMOOTHER: {}}
        for row in rows_in(study, "tiles"):
            way, texture = _case(row)
            content[way][texture] = measured(study, row) | {"scaled_percent": scaled[way, texture]}
        save("headline", content)
    put(ROOT / "README.md", "results", as_table(load("headline")[ROUGHER]))


def _case(row: Row) -> tuple[str, str]:
    return ROUGHER if row["touch.jnd"] > 0 else SMOOTHER, row["texture"].removesuffix("-tile")


def measured(study: Path, row: Row) -> dict[str, Any]:
    """What a run says of its result, by the run directory of its row."""
    verification = read_verification(folder_of(study, row))
    assert verification is not None and verification.touch.places is not None
    held_out, fingers = verification.touch.places.between, verification.touch.fingers
    assert held_out is not None and fingers is not None and verification.touch.measured is not None
    return {
        "percent": row["mean_change_percent_of_mean"],
        "jnd": [held_out.jnd_mean, held_out.jnd_min, held_out.jnd_max],
        "fingers_jnd": [fingers.jnd_mean, fingers.jnd_min, fingers.jnd_max],
        "measured_jnd": verification.touch.measured.jnd_mean,
        "cpu_s": row["cpu_s"],
    }


def as_table(rows: dict[str, Any]) -> str:
    """Five columns: tile, changes of the pictures, and what is felt."""
    head = ["tile", "change by scaling, %", "change by Retouch, %"]
    head += ["JND reached (range)", "JND of other fingers (range)"]
    lines = [
        [
            name,
            f"{row['scaled_percent']:.0f}",
            f"{row['percent']:.1f}",
            _range(row["jnd"], 2),
            _range(row["fingers_jnd"], 1),
        ]
        for name, row in rows.items()
    ]
    return table(head, lines)


def _range(jnd: list[float], digits: int) -> str:
    mean, least, most = (f"{value:+.{digits}f}" for value in jnd)
    return f"{mean} ({least} to {most})"


if __name__ == "__main__":
    main()
