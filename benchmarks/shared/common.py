"""Shared parts of the benchmarks: folders, arguments, results as JSON, tables, pages, the machine."""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import resource
import sys
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


def rows_parser(description: str | None) -> argparse.ArgumentParser:
    """A parser of the names of rows, and whether they are measured anew (`parts_of`)."""
    parser = parser_of(description)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="rows, or parts of their names; default: all"
    )
    parser.add_argument("--again", action="store_true", help="also rows that there are results of")
    return parser


def rows_of(
    description: str | None, name: str, part: str | None, measures: Mapping[str, Callable[[], Any]]
) -> dict[str, Any]:
    """The rows of one part, as the command line asks for them (`parts_of`)."""
    return parts_of(rows_parser(description).parse_args(), name, {part: measures})[part]


def parts_of(
    asked: argparse.Namespace, name: str, parts: Mapping[str | None, Mapping[str, Callable[[], Any]]]
) -> dict[str | None, dict[str, Any]]:
    """Rows of parts of the results (`kept`), of those that can be measured.

    Args:
        asked: what `rows_parser` found.
        name: of the results.
        parts: what measures each row, by part; None: its rows are the content itself.

    Raises:
        SystemExit: the command line names a row that is none.
    """
    every = [row for measures in parts.values() for row in measures]
    wanted = {row for row in every if not asked.names or any(one in row for one in asked.names)}
    if unknown := [one for one in asked.names if not any(one in row for row in wanted)]:
        sys.exit(f"{unknown[0]}: is part of none of: {'; '.join(every)}")
    found = {}
    for part, measures in parts.items():
        for row, measure in measures.items():
            if row in wanted:
                kept(name, part, row, measure, asked.again)
        there = load(name) if part is None else load(name).get(part, {})
        found[part] = {row: there[row] for row in measures if row in there}
    return found


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


def kept(name: str, part: str | None, row: str, measure: Callable[[], Any], again: bool = False) -> Any:
    """A row of a part of the results: measured, saved and printed if missing, or if asked for again.

    The results are read a second time before they are saved: another process may have added rows meanwhile.
    """
    rows = load(name) if part is None else load(name).get(part, {})
    if row in rows and not again:
        return rows[row]
    measured = {row: measure()}
    content = load(name)
    added = measured if part is None else {part: content.get(part, {}) | measured}
    save(name, content | {"machine": machine()} | added)
    print(row, measured[row], flush=True)
    return measured[row]


def put(page: Path, name: str, text: str) -> None:
    """Replace what stands on a page in the place of a name.

    A place begins with `<!-- NAME, made by python -m COMMAND -->` and ends with `<!-- end of NAME -->`.

    Raises:
        ValueError: the page has no such place.
    """
    place = rf"(<!-- {re.escape(name)}, made by [^>]+ -->\n).*(<!-- end of {re.escape(name)} -->)"
    before = page.read_text(encoding="utf-8")
    after, found = re.subn(
        place, lambda ends: f"{ends[1]}{text.rstrip()}\n{ends[2]}", before, flags=re.DOTALL
    )
    if not found:
        raise ValueError(f"{page}: has no place for {name}")
    page.write_text(after, encoding="utf-8")


def publish(page: str, name: str, text: str) -> None:
    """Print a text and put it in its place on a page of docs/evidence (`put`)."""
    print(text)
    put(DOCS / "evidence" / f"{page}.md", name, text)


def cpu_s() -> float:
    """CPU seconds of this process and of its children that have ended."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A Markdown table, columns aligned."""
    cells = [[_cell(c) for c in row] for row in (head, *rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(head))]
    lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |" for row in cells]
    return "\n".join((lines[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *lines[1:]))


def table_of(name: str, rows: Mapping[str, Mapping[str, Any]], columns: Mapping[str, str]) -> str:
    """A Markdown table of rows by name; columns have formats of a row's keys, such as `{jnd:+.2f}`."""
    lines = [[row, *(each.format(**keys) for each in columns.values())] for row, keys in rows.items()]
    return table((name, *columns), lines)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def _lines(path: str) -> list[str]:
    return Path(path).read_text().splitlines() if Path(path).is_file() else []
