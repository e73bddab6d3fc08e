"""`retouch study`: many runs that one file describes, as tables, plots and pictures on one page."""

import argparse
import math
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mitsuba_scenes.studies import bundled_studies, find_study
from relief.common.errors import InputError
from retouch.commands.options import add_talk, add_workers, console, print_json

COMPLETE, WITH_FAILURES = 0, 1
"""Exit statuses: every row is done, or some have failed."""
MOST_SHOWN = 10
"""Most faults and failures that are printed; the page lists all."""

HELP = "compute tables of runs that a study file describes"
DESCRIPTION = """\
Computes every row of a study, each a run of `retouch optimize` in a process with one thread, and draws a
page with tables, plots and pictures. Rows that are done are not computed again.
"""
EPILOG = """\
examples:
  retouch study --list
  retouch study demo --quick
  retouch study --all --quick
  retouch study my-study.toml -o runs/my-study --textures ~/materials
  retouch study my-study.toml --redraw

DIR then holds index.html (the page), rows.csv, study.json with every number, and rows/, the run directories.
docs/studies.md describes study files and columns.

exit status: 0 if every row is done; 1 if some have failed or cannot be computed; 2 for bad input; 130 if
interrupted. After 1 and 130 the same command goes on.
"""
AFTER_INTERRUPT = "; rows that are done stay, and the same command goes on"
"""End of the line that an interrupt prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "study",
        type=Path,
        nargs="?",
        metavar="FILE|NAME",
        help="study file (.toml), or the name of a study that comes with Retouch",
    )
    parser.add_argument("--list", action="store_true", help="list the studies that come with Retouch")
    parser.add_argument(
        "--all",
        action="store_true",
        help="compute these one after another, each into the folder of its name in DIR (default: runs)",
    )
    parser.add_argument(
        "-o",
        dest="out",
        type=Path,
        metavar="DIR",
        help="folder to write to (default: runs/<name of the study>)",
    )
    rows = parser.add_argument_group("the rows")
    rows.add_argument("--quick", action="store_true", help="the study in small, by its section [quick]")
    rows.add_argument(
        "--textures",
        type=Path,
        metavar="DIR",
        help="height maps in place of the values of each axis `texture`",
    )
    rows.add_argument(
        "--from",
        dest="given",
        type=Path,
        metavar="FILE",
        help="the study.json of another folder, whose rows count as done",
    )
    work = parser.add_argument_group("the work")
    one = work.add_mutually_exclusive_group()
    one.add_argument("--again", action="store_true", help="compute each row anew")
    one.add_argument("--redraw", action="store_true", help="compute nothing, draw what is there")
    add_workers(work)
    add_talk(parser, "the folder, every row and every failure")


def run(arguments: argparse.Namespace) -> int:
    if arguments.list:
        return _list(arguments)
    if arguments.all == (arguments.study is not None):
        raise InputError("study: name a study file, or a study that comes with Retouch, or --all; see --list")
    paths = bundled_studies() if arguments.all else [find_study(arguments.study)]
    if arguments.all and arguments.given is not None:
        raise InputError("--from: is the document of one study, not of all")
    out: Path = arguments.out or (Path("runs") if arguments.all else Path("runs") / paths[0].stem)
    outcomes = [_study(path, out / path.stem if arguments.all else out, arguments) for path in paths]
    if arguments.json:
        print_json([one.entry for one in outcomes] if arguments.all else outcomes[0].entry)
    return max(one.status for one in outcomes)


@dataclass(frozen=True)
class _Outcome:
    """What became of a study: exit status, and what `--json` prints."""

    status: int
    entry: dict[str, Any]


def _study(path: Path, out: Path, arguments: argparse.Namespace) -> _Outcome:
    """Compute or redraw a study, write its files, and tell what became of it."""
    from relief.common.formatting import duration
    from retouch.studies import engine
    from retouch.studies.document import flat_rows, read_document
    from retouch.studies.rows import expand
    from retouch.studies.study_file import load_study
    from retouch.studies.writing import write_study
    from retouch.workers.choice import runner

    began = time.monotonic()
    study = load_study(path)
    expanded = expand(study, arguments.quick, arguments.textures)
    given = None if arguments.given is None else read_document(arguments.given).records
    _tell(expanded.faults)
    if arguments.redraw:
        engine.check_folder(out)
        rows = engine.known(expanded, out, study.measures, given)
    else:
        rows = engine.compute(
            expanded,
            out,
            lambda work, observer: runner(work, arguments.workers, arguments.dask, observer),
            study.measures,
            given,
            arguments.again,
        )
    content = write_study(out, study, expanded, rows, arguments.quick)
    failed = [f"{out / engine.ROWS / key[:12]}: {reason}" for key, reason in rows.failures.items()]
    if not arguments.json:
        _tell(failed)
    if not arguments.json and not arguments.quiet:
        missing = len(expanded.rows) - len(rows.records) - len(failed)
        rest = f", {missing} not computed yet" if missing else ""
        took = "" if arguments.redraw else f", {duration(time.monotonic() - began)}"
        print(f"{out / engine.PAGE}: {len(rows.records)} rows, {len(failed)} failed{rest}{took}", flush=True)
    files = [str(out / name) for name in (engine.PAGE, engine.SPREADSHEET, engine.DOCUMENT)]
    failures = [*expanded.faults, *failed]
    entry = {"folder": str(out), "rows": flat_rows(content), "failures": failures, "files": files}
    return _Outcome(WITH_FAILURES if failures else COMPLETE, entry)


def _tell(lines: Sequence[str]) -> None:
    """Print faults or failures on stderr."""
    for line in lines[:MOST_SHOWN]:
        print(line, file=sys.stderr)
    if len(lines) > MOST_SHOWN:
        print(f"... and {len(lines) - MOST_SHOWN} more, which the page lists", file=sys.stderr)


def _list(arguments: argparse.Namespace) -> int:
    """Print the bundled studies."""
    from rich.table import Table

    from retouch.studies.rough_time import about
    from retouch.studies.study_file import load_study

    found: list[dict[str, Any]] = []
    for path in bundled_studies():
        study = load_study(path)
        sizes = {"whole": about(study, quick=False), "quick": about(study, quick=True)}
        found.append({"name": study.name, "title": study.title, **sizes})
    if arguments.json:
        print_json(found)
        return COMPLETE
    rows = Table(box=None, pad_edge=False)
    for heading in ("name", "title", "rows, minutes", "with --quick"):
        rows.add_column(heading)
    for one in found:
        forms = (one["whole"], one["quick"])
        texts = [f"{form['rows']}, about {math.ceil(form['minutes'])}" for form in forms]
        rows.add_row(one["name"], one["title"], *texts)
    console().print(rows)
    return COMPLETE
