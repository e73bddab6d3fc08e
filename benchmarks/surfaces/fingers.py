"""The front of fingers: how alike a change feels to 18 skins, against the change of the pictures.

retouch study benchmarks/surfaces/fingers.toml -o runs/fingers
python -m benchmarks.surfaces.fingers runs/fingers     # presses the results of the study
python -m benchmarks.surfaces.fingers                  # draws docs/images/fingers.png again, writes the table

Rows of results/fingers.json hold the change of the pictures as the descent saw it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch

import tactile
from benchmarks.shared.chart_style import FAINT, frame, pyplot, style, write
from benchmarks.shared.common import DOCS, IMAGES, load, machine, publish, save, study_given, table
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from optimize.run_directory.finished_run import FinishedRun
from relief.ground.arrays import Array
from tactile.jnd import ROUGHNESS_JND

CASES = ("gravel+2", "brick+2", "grass-2")
"""Texture and JND of each front; the default finger is the one optimised for."""
MODULI_MPA = (0.25, 0.354, 0.5, 0.707, 1.0, 2.0)
DEPTHS_MM = (0.5, 0.75, 1.0)
WEIGHTS = ("0", "5", "10", "20", "40", "80")
"""Weights of the table, as the study names them."""
IMAGE = IMAGES / "fingers.png"


def main() -> None:
    study = study_given(__doc__)
    if study is not None:
        rows = {f"{row['case']}, {row['weight']}": measured(study, row) for row in rows_in(study)}
        save("fingers", {"rows": rows, "machine": machine()})
    rows = load("fingers")["rows"]
    page = DOCS / "evidence" / "touch.md"
    publish(page, "range of fingers", "benchmarks.surfaces.fingers", as_text(rows))
    draw(rows)


def measured(study: Path, row: Row) -> dict[str, Any]:
    """How the result of a row feels to each skin, and what it cost."""
    run = FinishedRun.read(folder_of(study, row))
    before, after = by_skin(run.original.heights), by_skin(run.result.heights)
    off = np.log(after / before) / np.log(ROUGHNESS_JND)
    return {
        "reason": row["reason"],
        "steps": row["steps"],
        "cpu_seconds": row["cpu_s"],
        "picture_rms_percent": row["change_rms_percent"],
        "picture_mean_percent": row["change_percent"],
        "jnd_mean": float(off.mean()),
        "jnd_std": float(off.std()),
        "jnd_min": float(off.min()),
        "jnd_max": float(off.max()),
        "jnd": off.reshape(len(DEPTHS_MM), len(MODULI_MPA)).tolist(),
    }


def by_skin(heights: Array) -> Array:
    """(skins,) roughness by the elastic layer, in single precision, for every depth and modulus."""
    field = torch.as_tensor(heights, dtype=torch.float32)
    skins = [tactile.Skin(modulus, depth_mm=depth) for depth in DEPTHS_MM for modulus in MODULI_MPA]
    touches = (tactile.press(field, skin=skin) for skin in skins)
    return np.array([float(tactile.roughness(touch.strain)) for touch in touches])


def as_text(rows: dict[str, Any]) -> str:
    """By weight of the other fingers: change of the pictures (rms), and standard deviation of the JND."""
    lines = [[weight, *(_cell(rows.get(f"{case}, {weight}")) for case in CASES)] for weight in WEIGHTS]
    return table(("weight", *(f"{case}: pictures, spread" for case in CASES)), lines)


def _cell(row: dict[str, Any] | None) -> str:
    return "-" if row is None else f"{row['picture_rms_percent']:.1f} %, {row['jnd_std']:.2f} JND"


def draw(rows: dict[str, Any]) -> None:
    """The front of every case: spread over the skins against the change of the pictures."""
    style()
    figure, axes = pyplot.subplots(1, len(CASES), figsize=(9.0, 3.2), sharey=True, layout="constrained")
    highest = 1.1 * max(row["jnd_std"] for row in rows.values())
    for axis, case in zip(axes, CASES, strict=True):
        front = sorted(
            (float(name.partition(", ")[2]), row) for name, row in rows.items() if name.startswith(f"{case},")
        )
        changes, spreads = ([row[key] for _, row in front] for key in ("picture_rms_percent", "jnd_std"))
        frame(axis)
        axis.plot(changes, spreads, "o-", color="#3b6ea8", markersize=4)
        for (weight, _), change, spread in zip(front, changes, spreads, strict=True):
            # To the left, where no other point is.
            name, offset, side = (f"{weight:g}", 5, "left") if weight else ("one finger", -5, "right")
            axis.annotate(
                name, (change, spread), (offset, 3), textcoords="offset points", fontsize=8, ha=side
            )
        axis.axhline(0.5 * spreads[0], color=FAINT, linewidth=0.8, linestyle=":")
        axis.axvline(1.4 * changes[0], color=FAINT, linewidth=0.8, linestyle=":")
        axis.set(
            title=case.replace("-", " −").replace("+", " +") + " JND",
            xlim=(0.0, 1.15 * max(changes)),
            ylim=(0.0, highest),
        )
        axis.set_xlabel("change of the pictures, rms, %")
    axes[0].set_ylabel("standard deviation over 18 skins, JND")
    note = "Numbers: weight of the other fingers. Dotted: half of the spread, 1.4 times the change."
    figure.supxlabel(note, fontsize=8, color=FAINT)
    write(figure, IMAGE, dpi=150)


if __name__ == "__main__":
    main()
