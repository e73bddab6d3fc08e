"""Parts from public repositories: the share that `retouch wrap` lets out, and what is wrong with these.

python -m benchmarks.objects.public [NAME ...] [--folder FOLDER] [--again]

`parts.json` lists the files by repository, commit, path and SHA-256; FOLDER (runs/public) holds them as
OWNER/REPOSITORY/PATH. Each is wrapped with leather of 0.4 mm on 200,000 triangles, first by default, then, as
long as it is refused, with the option that the line of the refusal advises. Each wrap is a process of its own
with limits of CPU time and memory. What comes out is compared with its file.
"""

import hashlib
import json
import math
import re
import tempfile
from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from benchmarks.objects.public.found import RELIEF_MM, faces_of, faults, found
from benchmarks.shared.common import load, parts_of, publish, rows_parser, table
from benchmarks.shared.processes import process

PARTS: list[dict[str, str]] = json.loads((Path(__file__).parent / "parts.json").read_text("utf-8"))
RESULT, TEXTURE, FACES = "public_parts", "leather-tile", 200_000
MOST_CPU_S, MOST_GB = 150, 6
"""CPU seconds and memory, GB, after which a wrap is ended."""
WIDE = re.compile(r"the largest ([\d.e+]+) mm wide")
MOST_TRIES = 4


def name_of(part: Mapping[str, str]) -> str:
    """Repository and path."""
    return f"{part['repository']}/{part['path']}"


def wrapped(file: Path, out: Path, options: tuple[str, ...]) -> dict[str, Any]:
    """Cost of `retouch wrap` on a file, and the last line of a refusal."""
    command = ["-m", "retouch", "wrap", TEXTURE, str(file), "--relief-mm", f"{RELIEF_MM:g}"]
    command += ["--faces", str(FACES), "-q", *options, "-o", str(out)]
    ended = process(command, most=(MOST_CPU_S, MOST_GB))
    row = {"cpu_s": round(ended.cpu_s, 1), "peak_gb": round(ended.peak_gb, 2)}
    if ended.status == 0:
        return row
    if ended.status < 0:
        return row | {"ended": f"after {MOST_CPU_S} CPU s"}
    line = (ended.err.strip().splitlines() or [str(ended.status)])[-1]
    return row | {"refused": line.replace(str(file), file.name)}


def advised(line: str, options: tuple[str, ...], unit: str = "mm") -> tuple[str, ...]:
    """Options that the line of a refusal advises, beside those that were given; empty if it advises none.

    Args:
        line: of the refusal.
        options: that were given.
        unit: of the file, which its owner knows.
    """
    more: list[str] = []
    if "--close-holes" in line and (match := WIDE.search(line)):
        more = ["--close-holes", f"{math.ceil(1.01 * float(match[1]))}"]
    elif "--unite" in line:
        more = ["--unite"]
    elif "--units" in line:
        more = ["--units", unit]
    return (*options, *more) if more and more[0] not in options else ()


def measured(part: Mapping[str, str], root: Path) -> dict[str, Any]:
    """Result of one file: the tries, each with its options, and numbers of what comes out of the last."""
    file = root.resolve() / part["repository"] / part["path"]
    if hashlib.sha256(file.read_bytes()).hexdigest() != part["sha256"]:
        raise SystemExit(f"{file}: is not the file of the list")
    tries: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / ("out.3mf" if file.suffix.lower() == ".3mf" else "out.stl")
        given: tuple[str, ...] = ()
        while len(tries) < MOST_TRIES:
            tries.append({"options": " ".join(given), **wrapped(file, out, given)})
            line = tries[-1].get("refused", "")
            if not (more := advised(line, given, part.get("unit", "mm"))):
                break
            given = more
        came_out = not tries[-1].keys() & {"refused", "ended"}
        row: dict[str, Any] = {"kind": part["kind"], "tries": tries, "out": came_out}
        # In a process of its own, as the memory of this one counts for those that it starts.
        with ProcessPoolExecutor(1, get_context("spawn")) as pool:
            row["faces"] = pool.submit(faces_of, file).result()
            if came_out:
                row |= pool.submit(found, file, out, given).result()
                row["faults"] = faults(row)
    return row


def outcome(row: Mapping[str, Any]) -> str:
    """Outcome of a file: sound, faulty, refused or time."""
    if row["out"]:
        return "faulty" if row["faults"] else "sound"
    return "time" if "ended" in row["tries"][-1] else "refused"


def summary(results: Mapping[str, Any]) -> str:
    """Files by kind: how many were run, came out, were refused needlessly, and took too long."""
    rows = []
    for kind in [*sorted({part["kind"] for part in PARTS}), ""]:
        some = {name: row for name, row in results["now"].items() if kind in row["kind"]}
        count = Counter(map(outcome, some.values()))
        needless = sum(results["judged"].get(name, "").startswith("needless") for name in some)
        rows.append((kind or "all", len(some), count["sound"] + count["faulty"], needless, count["time"]))
    return table(("kind", "run", "came out", "refused needlessly", "took too long"), rows)


def main() -> None:
    parser = rows_parser(__doc__)
    parser.add_argument("--folder", type=Path, default=Path("runs/public"), help="of the files")
    asked = parser.parse_args()
    measures = {name_of(part): partial(measured, part, asked.folder) for part in PARTS}
    parts_of(asked, RESULT, {"now": measures})
    publish("objects", "public", summary(load(RESULT)))


if __name__ == "__main__":
    main()
