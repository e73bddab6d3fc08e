"""Presses by this version and by an earlier one, in pairs, each as it ends by its own rule.

python -m benchmarks.touch.press_pairs --before 80cde0d4    # about three minutes

Textures under the flat and the measured finger, cold, in double and in single precision, and 16 places of
gravel as a tile by the layer and by finite elements. Both versions run in processes of their own on one
thread; pairs in the order ABBA. The bound of the energy's error is that of this version for both. Writes
results/press_pairs.json and a place of docs/evidence/touch.md.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch

from benchmarks.shared.checkouts import NOW, checkouts
from benchmarks.shared.common import DOCS, machine, parser_of, publish, save, table
from benchmarks.shared.pairs import in_pairs, ratio
from benchmarks.touch.press_server import prepared
from tactile.pressing import Press

PAGE = DOCS / "evidence" / "touch.md"
TEXTURES = ("gravel", "bark", "leather", "knit")
CASES = [
    *[(skin, texture, "layer", precision)
      for skin in ("paper", "measured") for precision in ("float64", "float32") for texture in TEXTURES],
    ("paper", "gravel-tile", "layer", "float64"),
    ("paper", "gravel-tile", "layer", "float32"),
    ("paper", "gravel-tile", "fem", "float64"),
]  # fmt: skip
"""Skin, texture, model and precision."""
SERVER = Path(__file__).with_name("press_server.py")
PAIRS, PAIRS_OF_TILES = 9, 5


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--before", metavar="COMMIT", default="80cde0d4")
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    with checkouts(arguments.before) as folders, tempfile.TemporaryDirectory() as scratch:
        before, now = (Server(folder, Path(scratch)) for folder in folders.values())
        rows = [row_of(case, before, now) for case in CASES]
    content = {"machine": machine(), "before": arguments.before, "rows": rows}
    save("press_pairs", content)
    publish(PAGE, "press_pairs", f"benchmarks.touch.press_pairs --before {arguments.before}", as_text(rows))


class Server:
    """A process that presses by one version of the code; pressures are left in a file."""

    def __init__(self, tree: Path, scratch: Path) -> None:
        self.file = scratch / f"{tree.name}-{NOW}.npy"
        self._process = subprocess.Popen(
            [sys.executable, SERVER],
            env={**os.environ, "PYTHONPATH": f"{tree}"},
            cwd=tree,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def press(self, case: tuple[str, ...]) -> float:
        """CPU seconds of a press."""
        assert self._process.stdin is not None and self._process.stdout is not None
        print(json.dumps([*case, str(self.file)]), file=self._process.stdin, flush=True)
        return float(self._process.stdout.readline())


def row_of(case: tuple[str, ...], before: Server, now: Server) -> dict[str, Any]:
    """Ratio of CPU seconds, and the bounds of both, of the place where it is largest."""
    bounds = []
    for server in (before, now):
        server.press(case)
        bounds.append(bound_of(case, np.load(server.file)))
    tiled = case[1].endswith("-tile")
    seconds = in_pairs(
        lambda: now.press(case), lambda: before.press(case), PAIRS_OF_TILES if tiled else PAIRS
    )
    row: dict[str, Any] = dict(zip(("skin", "texture", "model", "precision"), case, strict=True))
    row |= {**ratio(*seconds), "bound_before": bounds[0], "bound": bounds[1]}
    print(row, flush=True)
    return row


def bound_of(case: tuple[str, ...], pressure_mpa: Any) -> float:
    """Largest bound of the energy's error of pressures (places, n, n), as in `tactile.contact`, in double."""
    model, fields = prepared(case[0], case[1], case[2], "float64")
    press = Press.of(model.skin, model.operator)
    heights = press._relative_heights(fields)
    p = torch.as_tensor(pressure_mpa).view(heights.shape) / model.skin.young_modulus_mpa
    displacement, axes = model.operator.displacement(p), (-2, -1)
    gap = displacement - heights
    released = (p * gap).sum(axes) - p.sum(axes) * gap.amin(axes)
    return float((released / (0.5 * (p * displacement).sum(axes))).max())


def as_text(rows: list[dict[str, Any]]) -> str:
    """CPU milliseconds, ratio with its interval, and both bounds."""
    head = (
        "finger",
        "texture",
        "model",
        "precision",
        "before, ms",
        "now, ms",
        "ratio",
        "95 %",
        "bound before",
        "now",
    )
    lines = [
        (
            *(row[key] for key in ("skin", "texture", "model", "precision")),
            *(1e3 * row[key] for key in ("over_cpu_s", "cpu_s")),
            row["ratio"],
            f"{row['low']:.2f} to {row['high']:.2f}",
            row["bound_before"],
            row["bound"],
        )
        for row in rows
    ]
    return table(head, lines)


if __name__ == "__main__":
    main()
