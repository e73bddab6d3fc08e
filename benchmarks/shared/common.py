"""Shared parts of the benchmarks: folders, arguments, results as JSON, tables, pages, the machine."""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from relief.ground.files import write_atomically

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "benchmarks" / "results"
DOCS = ROOT / "docs"
IMAGES = DOCS / "images"


def parser_of(description: str | None) -> argparse.ArgumentParser:
    """A parser that shows the docstring of a benchmark as it is written."""
    return argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def again_given(description: str | None) -> bool:
    """Whether the command line asks by `--again` that results which are there are measured anew."""
    parser = parser_of(description)
    parser.add_argument("--again", action="store_true")
    return bool(parser.parse_args().again)


def study_given(description: str | None) -> Path | None:
    """Folder of a finished study, if the command line names one."""
    parser = parser_of(description)
    parser.add_argument("study", type=Path, nargs="?", metavar="STUDY", help="folder of the finished study")
    study: Path | None = parser.parse_args().study
    return study


def folder_named(description: str | None, name: str) -> Path:
    """The one folder that the command line names."""
    parser = parser_of(description)
    parser.add_argument("folder", type=Path, metavar=name)
    folder: Path = parser.parse_args().folder
    return folder


def machine() -> dict[str, Any]:
    """Processor, cores in use and versions, which are saved with the numbers."""
    cpu = next(
        (line.split(":", 1)[1].strip() for line in _lines("/proc/cpuinfo") if line.startswith("model name")),
        platform.processor(),
    )
    packages = ("mitsuba", "drjit", "torch", "numpy", "scipy")
    return {
        "cpu": cpu,
        "cores": len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count(),
        "python": platform.python_version(),
        "versions": {name: version(name) for name in packages},
    }


def save(name: str, content: Mapping[str, Any]) -> Path:
    """Write `results/<name>.json`, whole."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}.json"
    write_atomically(path, (json.dumps(dict(content), indent=1) + "\n").encode())
    return path


def load(name: str) -> dict[str, Any]:
    """Results that an earlier run of the benchmark saved; empty without an earlier run."""
    path = RESULTS / f"{name}.json"
    if not path.is_file():
        return {}
    content: dict[str, Any] = json.loads(path.read_text())
    return content


def kept(name: str, part: str, row: str, measure: Callable[[], Any], again: bool = False) -> Any:
    """A row of a part of the results: measured, saved and printed if missing, or if asked for again.

    The results are read a second time before they are saved: another process may have added rows meanwhile.
    """
    rows = load(name).get(part, {})
    if row in rows and not again:
        return rows[row]
    measured = measure()
    content = load(name)
    save(name, content | {"machine": machine(), part: content.get(part, {}) | {row: measured}})
    print(row, measured, flush=True)
    return measured


def put(page: Path, name: str, command: str, text: str) -> bool:
    """Replace what stands on a page in the place of a name; False if the page has no such place.

    A place begins with `<!-- NAME, made by python -m COMMAND -->` and ends with `<!-- end of NAME -->`.
    """
    start, end = f"<!-- {name}, made by python -m {command} -->\n", f"<!-- end of {name} -->"
    before, found, rest = page.read_text(encoding="utf-8").partition(start)
    if found:
        page.write_text(f"{before}{start}{text}{end}{rest.partition(end)[2]}", encoding="utf-8")
    return bool(found)


def publish(page: Path, name: str, command: str, text: str) -> None:
    """Print a text and put it in its place on a page (`put`)."""
    print(text)
    put(page, name, command, f"{text}\n")


def median_seconds(work: Callable[[], object], repeats: int) -> float:
    """Median of several calls, after one to warm up."""
    work()
    found = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        found.append(time.perf_counter() - began)
    return statistics.median(found)


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table, columns aligned."""
    cells = [[_cell(c) for c in row] for row in (head, *rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |" for row in cells]
    return "\n".join((lines[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *lines[1:]))


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _lines(path: str) -> list[str]:
    return Path(path).read_text().splitlines() if Path(path).is_file() else []
