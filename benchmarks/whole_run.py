"""Whole runs: wall and CPU seconds of their parts, before and after a change; what each rule saves; memory.

python -m benchmarks.whole_run                            # every case of benchmarks.runs.turns
python -m benchmarks.whole_run --before 340f9f0           # an earlier commit beside this tree, in turns
python -m benchmarks.whole_run --before 340f9f0 --cases tile 256x256 --repeats 3
python -m benchmarks.whole_run change                     # error of the picture change by samples
python -m benchmarks.whole_run rules                      # seconds with and without each rule of visual.needs
python -m benchmarks.whole_run memory                     # peak memory of each verb
python -m benchmarks.whole_run start --before 3b5b75a0    # commands that are over soon, in turns

Cases: the six demo runs, exact and fast, the tile demo, gravel of 256 x 256 samples, and plates of 25, 40 and
80 mm (two JND rougher all over, by the fast look; 80 mm are solved window by window). Every run is a process
of its own, as a user starts it. Run the seconds on a quiet machine: all cases by two versions take about 40
minutes. The row of each run is kept at once in results/whole_run.json, with its commit and machine, and the
same command goes on where it was stopped. Runs of code with changes that are not committed (a "+" behind the
commit) are made anew.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from benchmarks.runs import turns
from benchmarks.runs.costs import change_by_samples, memory, start
from benchmarks.runs.rules import rules
from benchmarks.shared.checkouts import NOW, checkouts, version_of
from benchmarks.shared.common import DOCS, ROOT, load, machine, parser_of, publish, save, table

PAGE = DOCS / "evidence" / "speed.md"
COMMAND = "benchmarks.whole_run"
OTHERS = {"change": change_by_samples, "rules": rules, "memory": memory}
HEADINGS = {
    **{"wall_s": "seconds", "cpu_s": "CPU seconds", "touch_cpu_s": "touch, CPU s", "peak_mb": "peak MB"},
    **{"set_up_cpu_s": "set-up, CPU s", "descent_cpu_s": "descent", "verify_cpu_s": "verification"},
    **{"off_target_percent": "off target, %", "least_jnd": "least JND", "largest_jnd": "largest"},
    **{"change_percent": "pictures, %", "change_rms_percent": "rms, %"},
    **{"render_cpu_s": "pictures, CPU s", "step_cpu_s": "with Jacobians, CPU s"},
}
"""Column headings of keys that are not their own."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("what", nargs="?", default="seconds", choices=("seconds", "start", *OTHERS))
    parser.add_argument("--before", metavar="COMMIT")
    parser.add_argument("--cases", nargs="+", choices=turns.CASES, default=list(turns.CASES), metavar="NAME")
    parser.add_argument("--repeats", type=int, default=1, help="of cases below 40 mm; medians are shown")
    arguments = parser.parse_args()
    if arguments.what == "seconds":
        texts = seconds(arguments.before, arguments.cases, arguments.repeats)
    elif arguments.what == "start":
        rows = start(arguments.before)
        save("whole_run", load("whole_run") | {"start": {"machine": machine(), "rows": rows}})
        texts = {"start": as_text(by_version(rows))}
    else:
        rows = OTHERS[arguments.what]()
        save("whole_run", load("whole_run") | {"machine": machine(), arguments.what: rows})
        texts = {arguments.what: as_text(rows)}
    for what, text in texts.items():
        print(f"\n{what}")
        publish(PAGE, what, f"{COMMAND} {what}", text)


def seconds(before: str | None, names: Sequence[str], repeats: int) -> dict[str, str]:
    """Make the runs that are due, keep the row of each, and return the texts of all rows."""
    here = machine()
    with checkouts(before) as folders:
        trees = {version_of(ROOT) if name == NOW else name: folder for name, folder in folders.items()}
        rows = [row for row in load("whole_run").get("runs", ()) if not stale(row, names, here, trees)]
        due = turns.missing(rows, names, list(trees), repeats)
        print(f"{len(due)} runs to make, {len(rows)} rows are kept", flush=True)
        for row in turns.in_turns(due, trees):
            rows.append(row | {"machine": here})
            save("whole_run", load("whole_run") | {"runs": rows})
            cost = f"{row['wall_s']:.1f} s, {row['cpu_s']:.1f} CPU seconds"
            print(f"{row['case']}, {row['version']}: {cost}", flush=True)
    return texts_of(rows, list(trees), here)


def by_version(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """CPU seconds of each command, one column a version."""
    commands = dict.fromkeys(row["command"] for row in rows)
    return [
        {"command": name, **{row["version"]: row["cpu_s"] for row in rows if row["command"] == name}}
        for name in commands
    ]


def stale(
    row: Mapping[str, Any], names: Sequence[str], here: Mapping[str, Any], versions: Collection[str]
) -> bool:
    """Whether a row of these cases is of another machine or version, or of code that was not committed."""
    elsewhere = row["machine"] != here or row["version"] not in versions
    return row["case"] in names and (elsewhere or row["version"].endswith("+"))


def texts_of(
    rows: Sequence[Mapping[str, Any]], versions: Sequence[str], here: Mapping[str, Any]
) -> dict[str, str]:
    """Text of the rows of versions on one machine, by its place on the page."""
    each = {v: turns.medians([row for row in rows if row["machine"] == here], v) for v in versions}

    def every(plates: bool) -> str:
        names = [name for name, case in turns.CASES.items() if (case.size_mm > 10) == plates]
        found = [(name, version) for name in names for version in versions if name in each[version]]
        return as_text([{"case": name, "version": version, **each[version][name]} for name, version in found])

    parts = {
        "seconds": [turns.beside_aims(*each.values()) if len(versions) > 1 else "", every(plates=False)],
        "sizes": [turns.growth(each), every(plates=True)],
    }
    return {what: "\n\n".join(filter(None, texts)) for what, texts in parts.items() if any(texts)}


def as_text(rows: Sequence[Mapping[str, Any]]) -> str:
    """A table of rows that may differ in their columns."""
    if not rows:
        return ""
    head = list(dict.fromkeys(key for row in rows for key in row))
    cells = [[_short(row.get(key)) for key in head] for row in rows]
    return table([HEADINGS.get(key, key) for key in head], cells)


def _short(value: Any) -> Any:
    return round(value) if isinstance(value, float) and abs(value) >= 100.0 else value


if __name__ == "__main__":
    main()
