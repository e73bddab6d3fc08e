"""The front of fingers: how alike a change feels to 18 skins, against the change of the pictures.

retouch study benchmarks/surfaces/fingers.toml -o runs/fingers
python -m benchmarks.surfaces.fingers runs/fingers     # presses the results of the study
python -m benchmarks.surfaces.fingers                  # writes the table

Rows of results/fingers.json hold the change of the pictures as the descent saw it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch

import tactile
from benchmarks.shared.common import load, machine, publish, save, study_given, table
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


def main() -> None:
    study = study_given(__doc__)
    if study is not None:
        rows = {f"{row['case']}, {row['weight']}": measured(study, row) for row in rows_in(study)}
        save("fingers", {"rows": rows, "machine": machine()})
    publish("touch", "range of fingers", as_text(load("fingers")["rows"]))


def measured(study: Path, row: Row) -> dict[str, Any]:
    """How the result of a row feels to each skin, and what it cost."""
    run = FinishedRun.read(folder_of(study, row))
    before, after = by_skin(run.original.heights), by_skin(run.result.heights)
    off = np.log(after / before) / np.log(ROUGHNESS_JND)
    return {
        "picture_rms_percent": row["change_rms_percent"],
        "jnd_std": float(off.std()),
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


if __name__ == "__main__":
    main()
