"""Twenty parts of CAD kernels, modelling programs and scanners, wrapped: what comes out, and what it costs.

python -m benchmarks.objects.parts [NAME ...] [--again]

Each part is wrapped with `gravel-tile` by default, in its own process with limits of CPU time and memory.
What comes out is read by trimesh (closed or not) and by PrusaSlicer where it is installed, and is felt at 40
contact locations without the part's curvature. Parts that `results/wrapped_parts.json` has are not wrapped
again without `--again`.

The parts (3MF) are of build123d (15, within 0.02 mm and 0.15 rad), Blender (vase, hollow, monkey) and trimesh
(scan, capsule). `NAME-fine` are exports of eight of the first within 0.002 mm and 0.05 rad.
"""

import json
import re
import tempfile
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.objects.bundled import TEXTURE
from benchmarks.objects.parts.part_clients import looked_at
from benchmarks.shared.common import publish, rows_of, table
from benchmarks.shared.processes import process
from relief.solids.files.mesh import read_mesh

HERE = Path(__file__).parent
NAMES = sorted(file.stem for file in HERE.glob("*.3mf"))
MOST_CPU_S, MOST_GB = 180, 6
"""CPU seconds and memory, GB, after which a wrap is ended."""
ABOUT = re.compile(r"about ([\d,]+) triangles")
KEPT = ("faces", "edge_mm", "lowered", "median_factor", "lowest_factor")
"""Keys of `retouch wrap --json` whose values the table keeps."""
SHARES = (
    ("none of the area", 0.0, 1e-9),
    ("up to 4 %", 1e-9, 4.0),
    ("4 to 30 %", 4.0, 30.0),
    ("30 to 60 %", 30.0, 100.0),
)
"""Lines of the table: words, and the least and the largest share, %."""


def wrapped(name: str, out: Path) -> dict[str, Any]:
    """Numbers and cost of `retouch wrap` on a part, and the last line of a failure."""
    command = ("-m", "retouch", "wrap", TEXTURE, str(HERE / f"{name}.3mf"), "-o", str(out), "--json")
    ended = process(command, most=(MOST_CPU_S, MOST_GB))
    match = ABOUT.search(ended.err)
    row = {
        "told": int(match[1].replace(",", "")) if match else None,
        "cpu_s": ended.cpu_s,
        "peak_gb": ended.peak_gb,
    }
    if ended.status == 0:
        numbers = json.loads(ended.out)
        return row | {key: numbers[key] for key in KEPT}
    if ended.status < 0:
        return row | {"failure": f"ended after {MOST_CPU_S} CPU s"}
    if "MemoryError" in ended.err or "allocate" in ended.err:
        return row | {"failure": f"took more than {MOST_GB} GB"}
    return row | {"failure": (ended.err.strip().splitlines() or [str(ended.status)])[-1]}


def measured(name: str) -> dict[str, Any]:
    """Everything about one part."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "wrapped.3mf"
        row = {"faces_before": len(read_mesh(HERE / f"{name}.3mf").body.faces)}
        row |= wrapped(name, out)
        if "failure" in row:
            return row
        # In a process of its own, as the memory of this one counts for those that it starts.
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            work = pool.submit(looked_at, HERE / f"{name}.3mf", out)
            return row | work.result()


def summary(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """Parts by the share of their area on which the relief is lowered, for want of room."""
    lines = []
    for words, least, most in SHARES:
        some = [row for row in rows.values() if least <= 100.0 * row["lowered"] < most]
        jnd = [row["jnd_from_tile"] for row in some]
        lines.append(
            (
                words,
                len(some),
                f"{sum(row['closed'] for row in some)}, {sum(row['slicer'][:5] == 'sound' for row in some)}",
                f"{np.median(jnd):+.2f} ({min(jnd):+.2f} to {max(jnd):+.2f})",
                f"{np.median([row['cpu_s'] for row in some]):.0f}",
                f"{max(row['peak_gb'] for row in some):.1f}",
            )
        )
    head = ["relief lowered on", "parts", "closed, sound in PrusaSlicer"]
    head += ["from the tile, JND: median (range)", "CPU s, median", "GB, most"]
    return table(head, lines)


def main() -> None:
    measures = {name: partial(measured, name) for name in NAMES}
    rows = rows_of(__doc__, "wrapped_parts", "parts", measures)
    publish("objects", "parts", summary(rows))


if __name__ == "__main__":
    main()
