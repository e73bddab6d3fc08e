"""Twenty parts of CAD kernels, modelling programs and scanners, wrapped: what comes out, and what it costs.

python -m benchmarks.objects.parts [NAME ...] [--again] [--only-wrap] [--code FOLDER] [--blender PYTHON]
                                   [--keep FOLDER] [--unfelt]

Each part is wrapped with `gravel-tile` by default, in its own process with limits of CPU time and memory.
What comes out is read by trimesh (closed or not), by Blender where a Python with `bpy` is named (triangles
that cross one another, of which exact arithmetic tells how many do) and by PrusaSlicer where it is installed,
and is felt at 40 places without the part's curvature. Parts that `results/wrapped_parts.json` has are not
wrapped again without `--again`. `--code` names another checkout, whose `retouch wrap` is measured, and
`--keep` where the files go. `--unfelt` leaves out the finger, which takes a CPU minute.
`NAME-fine` are finer exports of eight parts.
"""

import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from argparse import Namespace
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.objects.bundled import TEXTURE, on_plate, tile_of
from benchmarks.objects.parts.part_clients import looked_at
from benchmarks.shared.common import DOCS, ROOT, kept, load, parser_of, publish, table
from relief.ground.arrays import Array
from relief.solids.files import read_mesh

HERE = Path(__file__).parent
NAMES = sorted(file.stem for file in HERE.glob("*.3mf"))
RESULT, COMMAND = "wrapped_parts", "benchmarks.objects.parts"
MOST_CPU_S, MOST_GB = 180, 6
"""CPU seconds and memory, GB, after which a wrap is ended."""
ABOUT = re.compile(r"about ([\d,]+) triangles")
KEPT = ("faces", "edge_mm", "lowered", "median_factor", "lowest_factor")
"""Keys of `retouch wrap --json` whose values the table keeps."""
HEAD = ["part", "its triangles", "told", "written", "CPU s", "GB", "closed"]
HEAD += ["pairs of Blender's", "that cross", "lowered, %", "to"]
HEAD += ["V", "from the tile, JND", "PrusaSlicer"]
"""Columns of the table."""


def _limit() -> None:
    """Limit the CPU time and the memory of the process."""
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S))
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_GB * 10**9, MOST_GB * 10**9))


def wrapped(name: str, out: Path, code: Path) -> dict[str, Any]:
    """Numbers and cost of `retouch wrap` on a part, and the last line of a failure."""
    command = (sys.executable, "-m", "retouch", "wrap", TEXTURE, str(HERE / f"{name}.3mf"), "-o", str(out))
    paths = {**os.environ, "PYTHONPATH": str(code)}
    with tempfile.TemporaryFile("w+") as said, tempfile.TemporaryFile("w+") as answer:
        child = subprocess.Popen(
            (*command, "--json"), cwd=code, env=paths, stdout=answer, stderr=said, preexec_fn=_limit
        )
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        answer.seek(0)
        lines = said.read()
        match = ABOUT.search(lines)
        row = {
            "told": int(match[1].replace(",", "")) if match else None,
            "cpu_s": usage.ru_utime + usage.ru_stime,
            "peak_gb": usage.ru_maxrss / 1e6,
        }
        if child.returncode == 0:
            numbers = json.loads(answer.read())
            return row | {key: numbers[key] for key in KEPT}
        if child.returncode < 0:
            return row | {"failure": f"ended after {MOST_CPU_S} CPU s"}
        if "MemoryError" in lines or "allocate" in lines:
            return row | {"failure": f"took more than {MOST_GB} GB"}
        return row | {"failure": lines.strip().splitlines()[-1] if lines.strip() else f"{child.returncode}"}


def measured(name: str, options: Namespace, plate: Array | None) -> dict[str, Any]:
    """Everything about one part."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "wrapped.3mf"
        row = {"faces_before": len(read_mesh(HERE / f"{name}.3mf").body.faces)}
        row |= wrapped(name, out, options.code.resolve())
        if options.keep is not None and "failure" not in row:
            options.keep.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(out, options.keep / f"{name}.3mf")
        if "failure" in row or options.only_wrap:
            return row
        # In a process of its own, as the memory of this one counts for those that it starts.
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            work = pool.submit(looked_at, HERE / f"{name}.3mf", out, options.blender, plate)
            return row | work.result()


def _line(name: str, row: Mapping[str, Any]) -> tuple[Any, ...]:
    """A line of the table; where nothing came out, why stands in the place of the slicer's word."""
    counts = [f"{row[key]:,}" if row.get(key) else None for key in ("faces_before", "told", "faces")]
    closed = {True: "yes", False: "no"}.get(row.get("closed"))  # type: ignore[arg-type]
    lowered = f"{100.0 * row['lowered']:.1f}" if "lowered" in row else None
    factor = f"{row['median_factor']:.2f}" if row.get("lowered") and "median_factor" in row else None
    felt = [f"{row[key]:{how}}" if key in row else None for key, how in FELT.items()]
    pairs = row.get("crossings"), row.get("crossings_exactly")
    last = _reason(row["failure"]) if "failure" in row else row.get("slicer")
    cost = f"{row['cpu_s']:.0f}", f"{row['peak_gb']:.1f}"
    return name, *counts, *cost, closed, *pairs, lowered, factor, *felt, last


FELT = {"roughness": ".4f", "jnd_from_tile": "+.2f"}
"""Formats of what is felt."""


def _reason(line: str) -> str:
    """Why a part did not come out, short enough for a table."""
    crossing = re.search(r"passes through itself: (?:at least )?(\d+ pairs)", line)
    return f"refused: {crossing[1]} cross" if crossing else line.rpartition(": ")[2].split("; ")[0]


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--again", action="store_true", help="also parts that there are results of")
    parser.add_argument("--only-wrap", action="store_true", help="look at nothing that comes out")
    parser.add_argument("--code", type=Path, default=ROOT, metavar="FOLDER")
    parser.add_argument("--blender", metavar="PYTHON")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="for the wrapped parts")
    parser.add_argument("--unfelt", action="store_true", help="do not press on what comes out")
    options = parser.parse_args()
    if unknown := set(options.names) - set(NAMES):
        parser.error(f"{', '.join(sorted(unknown))}: not among {', '.join(NAMES)}")
    plate = None if options.unfelt else on_plate(tile_of(TEXTURE))
    for name in options.names or NAMES:
        kept(RESULT, "parts", name, partial(measured, name, options, plate), options.again)
    text = table(HEAD, [_line(name, row) for name, row in sorted(load(RESULT)["parts"].items())])
    publish(DOCS / "evidence" / "objects.md", "parts", COMMAND, text)


if __name__ == "__main__":
    main()
