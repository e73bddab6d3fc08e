"""Whether runs end with the same heights, bit for bit, by the code of a commit and by that of this tree.

python -m benchmarks.runs.same_heights --before 340f9f0                 # about ten minutes
python -m benchmarks.runs.same_heights --before 340f9f0 -o FOLDER       # elsewhere than runs/same-heights

The six demo runs and the tile of the README, exact and `--fast`, one process at a time. A run that is done is
not run again: FOLDER/VERSION/CASE holds its directory. After a change of the code take another FOLDER, or
remove FOLDER/now. Writes results/same_heights.json; the exit status is 1 if any heights differ.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.checkouts import DEMO_RUNS, MODELS, NOW, checkouts, module_of, process
from benchmarks.shared.common import ROOT, machine, parser_of, save, table
from optimize.run_directory.key import RESULT
from relief.ground.arrays import Array
from relief.ground.formats import RUN_HEIGHTS
from relief.heightmap import load_heights

RUNS: Mapping[str, Sequence[str]] = {
    **{f"{name}{jnd:+d}": (name, "--set", f"touch.jnd={jnd}") for name, jnd in DEMO_RUNS},
    "gravel-tile+2": ("mitsuba_scenes/gravel-tile.toml",),
}
"""Arguments of `optimize` by the name of the run."""
DONE = (0, 3)
"""Exit statuses of a run that has a result: the target is met, or is not."""


def main() -> int:
    parser = parser_of(__doc__)
    parser.add_argument("--before", metavar="COMMIT", required=True)
    parser.add_argument("-o", dest="folder", type=Path, default=ROOT / "runs" / "same-heights")
    arguments = parser.parse_args()
    folder: Path = arguments.folder.absolute()
    with checkouts(arguments.before) as trees:
        for version, tree in trees.items():
            for case, command in commands().items():
                run(tree, command, folder / version / case)
    rows = compared(folder / arguments.before, folder / NOW)
    save("same_heights", {"machine": machine(), "before": arguments.before, "rows": rows})
    print(as_text(rows))
    return int(not all(row["equal"] for row in rows))


def commands() -> dict[str, Sequence[str]]:
    """Arguments of `optimize` by the name of the case: run and models."""
    return {f"{name}-{models}": (*RUNS[name], *MODELS[models]) for name in RUNS for models in MODELS}


def run(tree: Path, command: Sequence[str], out: Path) -> None:
    """A run by the code in a folder, unless it is done. Raises RuntimeError: the run has failed."""
    if (out / RESULT).is_file():
        return
    out.parent.mkdir(parents=True, exist_ok=True)
    seconds = process(
        tree, ["-m", module_of(tree), "optimize", *command, "-o", str(out), "-q", "--force"], DONE
    )
    print(f"{out}: {seconds['wall_s']:.0f} s", flush=True)


def compared(before: Path, now: Path) -> list[dict[str, Any]]:
    """Each case of two folders of runs: whether the heights are the same, and their largest distance, mm."""
    rows = []
    for name in RUNS:
        for models in MODELS:
            pair = [load_heights(folder / f"{name}-{models}" / RUN_HEIGHTS) for folder in (before, now)]
            rows.append({"case": name, "models": models, **difference(*pair)})
    return rows


def difference(before: Array, after: Array) -> dict[str, Any]:
    """Whether two reliefs are equal bit for bit, and their largest distance in mm.

    The distance is None where the shapes differ or a height is no number.
    """
    if before.shape != after.shape or before.dtype != after.dtype:
        return {"equal": False, "largest_mm": None}
    largest = float(np.abs(after - before).max())
    equal = before.tobytes() == after.tobytes()
    return {"equal": equal, "largest_mm": largest if np.isfinite(largest) else None}


def as_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """The table: equal, or the largest difference."""
    head = ("case", "models", "heights, mm")
    return table(head, [(row["case"], row["models"], _outcome(row)) for row in rows])


def _outcome(row: Mapping[str, Any]) -> str:
    if row["equal"]:
        return "equal"
    return "of other shape" if row["largest_mm"] is None else f"{row['largest_mm']:.3g} apart"


if __name__ == "__main__":
    sys.exit(main())
