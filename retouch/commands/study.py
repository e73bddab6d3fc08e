"""`retouch study`: compute tables of runs that a study file describes.

Computes every row of a study, each a run of `retouch optimize` in a process with one thread, and draws a
page with tables, plots and pictures. Rows that are done are not computed again.

examples:
  retouch study --list
  retouch study demo --quick
  retouch study published
  retouch study my-study.toml -o runs/my-study --textures ~/materials
  retouch study my-study.toml --redraw

DIR then holds index.html (the page), rows.csv, study.json with every number, and rows/, the run directories.
The guide's page "Studies" describes study files and columns. `published` is no table of runs: it presses the
stimuli of published experiments, and says which finger predicts what was found.

exit status: 0 if every row is done; 1 if some have failed or cannot be computed; 2 for bad input; 130 if
interrupted. After 1 and 130 the same command goes on.
"""

import argparse
import math
import sys
import time
from dataclasses import asdict
from pathlib import Path

import retouch
from relief.ground.errors import InputError
from relief.ground.formatting import duration
from retouch.commands.options import add, add_out, add_talk, add_workers, keywords, report
from retouch.pages.sentences import TextTable

COMPLETE, WITH_FAILURES = 0, 1
"""Exit statuses: every row is done, or some have failed."""

AFTER_INTERRUPT = "; rows that are done stay, and the same command goes on"
"""End of the line that an interrupt prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = "study file (.toml), or the name of a study that comes with Retouch"
    add(parser, "study FILE|NAME", text, type=Path, nargs="?")
    add(parser, "--list", "list the studies that come with Retouch")
    add_out(parser, "DIR", "folder to write to (default: runs/<name of the study>)")
    rows = parser.add_argument_group("the rows")
    add(rows, "--quick", "the study in small, by its section [quick]")
    add(rows, "--textures DIR", "height maps in place of the values of each axis `texture`", type=Path)
    text = "the study.json of another folder, whose rows count as done"
    add(rows, "--from FILE", text, dest="given", type=Path)
    work = parser.add_argument_group("the work")
    one = work.add_mutually_exclusive_group()
    add(one, "--again", "compute each row anew")
    add(one, "--redraw", "compute nothing, draw what is there")
    add_workers(work)
    add_talk(parser, "the folder, every row and every failure")


def run(arguments: argparse.Namespace) -> int:
    if arguments.list:
        return _list(arguments)
    if arguments.study is None:
        raise InputError("study: name a study file, or a study that comes with Retouch; see --list")
    began = time.monotonic()
    tables = retouch.study(**keywords(arguments, retouch.study))
    if not arguments.json:
        for line in tables.failures_shown():
            print(line, file=sys.stderr)
    rest = f", {tables.missing} not computed yet" if tables.missing else ""
    took = "" if arguments.redraw else f", {duration(time.monotonic() - began)}"
    line = f"{tables.page}: {tables.done} rows, {len(tables.failed)} failed{rest}{took}"
    report(arguments, tables.as_json(), [line])
    return COMPLETE if tables.complete else WITH_FAILURES


def _list(arguments: argparse.Namespace) -> int:
    """Print the bundled studies."""
    # Where nothing is listed, the studies' rooms need not be imported.
    from retouch.verbs.studying import listed_studies

    rows = []
    for study in (listed := listed_studies()):
        forms = (study.whole, study.quick)
        texts = [f"{form.rows}, about {math.ceil(form.minutes)}" for form in forms]
        rows.append((study.name, study.title, *texts))
    headings = ("name", "title", "rows, minutes", "with --quick")
    table = TextTable([(heading, "") for heading in headings], rows, gap=1)
    return report(arguments, [asdict(study) for study in listed], [table])
