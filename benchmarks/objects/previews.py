"""Previews of wrapping beside the wrapping itself: time, memory, triangles and bytes.

python -m benchmarks.objects.previews      # about four minutes; on a quiet machine
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.shared.common import DOCS, ROOT, machine, publish, save, table

PAGE = DOCS / "evidence" / "objects.md"
COMMAND = "benchmarks.objects.previews"
PARTS = ROOT / "benchmarks" / "objects" / "parts"
OBJECTS = (
    "frog",
    "cylinder",
    "starfish",
    "bracelet",
    *(str(PARTS / f"{n}.3mf") for n in ("capsule", "knob")),
)
HEAD = (
    *("object", "shown", "page, MB", "preview, CPU s", "s", "MB", "told: triangles", "written"),
    *("told: MB", "written, MB", "told, s", "wrap, s", "CPU s"),
)


def main() -> None:
    rows = {Path(name).stem: measured(name) for name in OBJECTS}
    save("previews", {"rows": rows, "machine": machine()})
    publish(PAGE, "previews", COMMAND, as_text(rows))


def measured(name: str) -> dict[str, Any]:
    """The preview of gravel on an object, and the object itself."""
    with tempfile.TemporaryDirectory() as folder:
        page, out = Path(folder) / "page.html", Path(folder) / "out.3mf"
        plan, preview = _run(name, "--preview", str(page))
        body, wrap = _run(name, "-o", str(out))
        return {"told": plan, "made": body, "preview": preview, "wrap": wrap, "page": page.stat().st_size}


def _run(name: str, *options: str) -> tuple[dict[str, Any], dict[str, float]]:
    """Report of `retouch wrap --json`, and time and memory of the whole command."""
    command = (sys.executable, "-m", "retouch", "wrap", "gravel-tile", name, *options, "--json")
    begun = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT)
    assert child.stdout is not None
    answer = json.loads(child.stdout.read())
    # Files of a folder that is gone afterwards.
    answer = {key: value for key, value in answer.items() if key not in ("file", "preview")}
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    seconds = {"s": time.perf_counter() - begun, "cpu_s": used.ru_utime + used.ru_stime}
    return answer, seconds | {"mb": used.ru_maxrss / 1e3}


def as_text(rows: dict[str, Any]) -> str:
    """The table of the page."""
    lines = []
    for name, row in rows.items():
        plan, body, preview, wrap = (row[key] for key in ("told", "made", "preview", "wrap"))
        lines.append(
            (
                *(name, f"{plan['shown_faces']:,}", f"{row['page'] / 1e6:.1f}"),
                *(f"{preview['cpu_s']:.1f}", f"{preview['s']:.1f}", f"{preview['mb']:.0f}"),
                *(f"{plan['faces']:,}", f"{body['faces']:,}"),
                *(f"{each['bytes'] / 1e6:.1f}" for each in (plan, body)),
                *(f"{plan['seconds']:.0f}", f"{wrap['s']:.0f}", f"{wrap['cpu_s']:.0f}"),
            )
        )
    return table(HEAD, lines)


if __name__ == "__main__":
    main()
