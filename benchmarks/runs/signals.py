"""Commands that Ctrl-C or a polite kill ends in their first seconds, and what each of them says.

python -m benchmarks.runs.signals                    # every case that is not in the results yet
python -m benchmarks.runs.signals --verbs evaluate   # of these verbs only
python -m benchmarks.runs.signals --checkout OTHER --into NAME   # the commands of another checkout

Seven commands are ended at moments from 0.05 to 4 s, spaced evenly in the logarithm, by SIGINT and SIGTERM in
turn. The table counts how they ended: with status 130 and one line, at the end of their work, by the signal
itself before Python had started the command, or wrongly.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import ROOT, kept, load, parser_of, save, table

NAME = "signals"
MOMENTS = 10
FIRST_S, LAST_S = 0.05, 4.0
"""Seconds from the start of a command to the signal, least and most."""
LONGEST_S = 300.0
"""Seconds after which a command counts as hanging."""
INTERRUPTED = 130
STARTING = "import retouch, optimize.runs"
"""What Python has loaded before the command can heed anything: a signal ends it in Python's own way."""

VERBS = {
    "prepare": "prepare gravel.png -o tile.png --relief-mm 1.2 --tile",
    "evaluate": "evaluate gravel brick --relief-mm 1.2",
    "reach": "evaluate gravel --reach",
    "render": "render studio --texture gravel.png --relief-mm 1.2 -o pictures",
    "compare": "compare gravel brick --relief-mm 1.2",
    "wrap": "wrap gravel-tile starfish -o starfish.3mf",
    "optimize": "optimize gravel -o run",
}
"""Commands by what they are called in the results."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--checkout", type=Path, default=ROOT, help="whose packages run (default: this one)")
    parser.add_argument("--verbs", nargs="+", choices=VERBS, default=tuple(VERBS))
    parser.add_argument("--into", default=NAME, help="results to write (default: signals)")
    arguments = parser.parse_args()
    for verb in arguments.verbs:
        for number, seconds in enumerate(np.geomspace(FIRST_S, LAST_S, MOMENTS).tolist()):
            by = (signal.SIGINT, signal.SIGTERM)[(number + list(VERBS).index(verb)) % 2]
            measure = partial(ended, arguments.checkout, verb, seconds, by)
            kept(arguments.into, "rows", f"{verb} {by.name} {seconds:.2f}", measure)
    save(arguments.into, load(arguments.into) | {"commands": VERBS})
    print(summary(load(arguments.into)["rows"]))


def ended(checkout: Path, verb: str, seconds: float, by: signal.Signals) -> dict[str, Any]:
    """How a command ends after so many seconds: its status and, if that is wrong, its last words."""
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", STARTING], env=environment, check=True)
    starting = time.perf_counter() - began
    with tempfile.TemporaryDirectory() as place:
        Path(place, "gravel.png").write_bytes((ROOT / "mitsuba_scenes/textures/gravel.png").read_bytes())
        process = subprocess.Popen(
            [sys.executable, "-m", "retouch", *VERBS[verb].split()],
            cwd=place,
            env=environment,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            # A background process of a shell ignores Ctrl-C, and so would what it starts.
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        time.sleep(seconds)
        process.send_signal(by)
        began = time.perf_counter()
        _, messages = process.communicate(timeout=LONGEST_S)
    lines, status = messages.splitlines(), process.returncode
    if status == INTERRUPTED and len([line for line in lines if "nterrupted" in line]) == 1:
        end = "interrupted"
    elif status in (0, 3):
        end = "at its end"
    elif seconds < starting and status in (-by, INTERRUPTED, 1):
        end = "before its start"
    else:
        end = "wrongly"
    good = end in ("interrupted", "at its end") and "Traceback" not in messages
    row = {"verb": verb, "by": by.name, "seconds": round(seconds, 2), "status": status, "end": end}
    row |= {"lines": len(lines), "after_s": round(time.perf_counter() - began, 2)}
    return row if good else row | {"told": lines[-3:]}


def summary(rows: dict[str, dict[str, Any]]) -> str:
    """The table: a row for each verb."""
    ends = ("interrupted", "at its end", "before its start", "wrongly")
    lines = []
    for verb in VERBS:
        of_verb = [row for row in rows.values() if row["verb"] == verb]
        counts = [sum(row["end"] == end for row in of_verb) for end in ends]
        waits = [row["after_s"] for row in of_verb if row["end"] == "interrupted"]
        lines.append([VERBS[verb], len(of_verb), *counts, max(waits, default=None)])
    totals = [sum(line[column] for line in lines) for column in range(1, 6)]
    return table(("command", "number", *ends, "longest wait, s"), [*lines, ["all", *totals, None]])


if __name__ == "__main__":
    main()
