"""`retouch dataset`: fields to train nets on."""

import argparse
import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from optimize.commands.options import seed, whole_number

if TYPE_CHECKING:
    from optimize.training.dataset import ShardResult

WHOLE = 0
WITH_FAILURES = 1
MOST_TEXTURES = 10_000_000
LEAST_SAMPLES, MOST_SAMPLES = 36, 4096
MOST_DIRECTIONS = 64
MOST_WORKERS = 1024
FAILURES = "failures.jsonl"
MOST_SHOWN = 5
"""Failures that are printed; the file lists all."""

HELP = "make fields to train the learned models on"
DESCRIPTION = """\
Draws a corpus of textures and computes for each what touch and sight make of it: strain, gap, roughness and
contact area by finite elements or the elastic layer; pictures under parallel lights, each alone, and under
ambient light. Written shard by shard into DIR: interrupted or killed, the same command goes on where it was.
"""
EPILOG = """\
examples:
  retouch dataset -o data --count 6300
  retouch dataset -o data --count 6300 --textures ~/materials --optimised runs/optimised
  retouch dataset -o data --count 100000 --touch layer --lights studio --dask tcp://10.0.0.1:8786

The format is told in docs/learned.md.

exit status: 0 if every texture has its fields; 1 if some have none, which failures.jsonl lists.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "-o", dest="out", type=Path, required=True, metavar="DIR", help="the data set, new or begun"
    )
    parser.add_argument("-q", dest="quiet", action="store_true", help="print nothing but errors")
    textures = parser.add_argument_group("the textures")
    textures.add_argument(
        "--count",
        type=whole_number(1, MOST_TEXTURES),
        required=True,
        metavar="N",
        help="how many to draw",
    )
    textures.add_argument("--seed", type=seed, default=0, metavar="S", help="of the corpus (default: 0)")
    textures.add_argument(
        "--textures",
        type=Path,
        action="append",
        default=[],
        metavar="FOLDER",
        help="height maps to cut textures from, beside scikit-image's; may be given several times",
    )
    textures.add_argument(
        "--optimised", type=Path, metavar="FOLDER", help="optimised textures with their manifest, to add"
    )
    fields = parser.add_argument_group("the fields")
    fields.add_argument(
        "--touch",
        choices=("fem", "layer", "none"),
        default="fem",
        help="model of touch: fem, finite elements (default); layer, faster; none",
    )
    fields.add_argument(
        "--lights",
        choices=("random", "studio", "none"),
        default="random",
        help="random, elevation 10 to 80 degrees (default); studio, its three; none, no pictures",
    )
    fields.add_argument(
        "--directions",
        type=whole_number(1, MOST_DIRECTIONS),
        metavar="K",
        help="random lights of each texture (default: 8)",
    )
    fields.add_argument(
        "--samples",
        type=whole_number(LEAST_SAMPLES, MOST_SAMPLES),
        default=144,
        metavar="N",
        help="shadow rays a pixel where light and shadow meet (default: 144)",
    )
    work = parser.add_argument_group("the work")
    work.add_argument(
        "--workers",
        type=whole_number(1, MOST_WORKERS),
        metavar="N",
        help="processes, of one thread each (default: one for each core)",
    )
    work.add_argument(
        "--dask",
        metavar="ADDRESS",
        help='scheduler of a Dask cluster, or "local" for a cluster of --workers here',
    )


def run(arguments: argparse.Namespace) -> int:
    # What is slow to import waits until the arguments are known to be good.
    from relief.errors import InputError

    if arguments.lights != "random" and arguments.directions is not None:
        raise InputError(f"--directions: --lights {arguments.lights} leaves no choice")
    if arguments.touch == arguments.lights == "none":
        raise InputError("--touch none --lights none: no field is left to compute")
    from optimize.training.dataset import DIRECTIONS, make, plan
    from optimize.training.workers import run_here, run_on_dask
    from relief.heightmap import load_field
    from surrogate.corpus.photographs import bundled, folder

    sources = bundled()
    for path in arguments.textures:
        sources += folder(path, load_field)
    wanted = plan(
        arguments.seed,
        arguments.count,
        sources,
        optimised=arguments.optimised,
        touch=arguments.touch,
        lights=arguments.lights,
        directions=DIRECTIONS if arguments.directions is None else arguments.directions,
        strata=math.ceil(math.sqrt(arguments.samples)),
    )
    workers = arguments.workers or _cores()
    runner = (
        partial(run_here, workers=workers)
        if arguments.dask is None
        else partial(run_on_dask, address=arguments.dask, workers=workers)
    )
    with _silent() if arguments.quiet else _shown(wanted.request.total) as told:
        failures = make(wanted, arguments.out, runner, told)
    if not arguments.quiet:
        there = wanted.request.total - len(failures)
        print(f"{arguments.out}: {there} textures with their fields, {len(failures)} without")
    for failure in failures[:MOST_SHOWN]:
        print(f"texture {failure.index} ({failure.source}): {failure.reason}", file=sys.stderr)
    if len(failures) > MOST_SHOWN:
        print(f"... the others are listed in {arguments.out / FAILURES}", file=sys.stderr)
    return WITH_FAILURES if failures else WHOLE


def _cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def _silent() -> Iterator[Callable[["ShardResult"], None]]:
    yield lambda made: None


@contextmanager
def _shown(total: int) -> Iterator[Callable[["ShardResult"], None]]:
    """A moving bar on a terminal, a line a shard in a file or pipe."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(highlight=False, stderr=True)
    if not console.is_terminal:
        yield _lines(total, console.print)
        return
    columns = TextColumn("textures"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console) as progress:
        bar = progress.add_task("textures", total=total)
        yield lambda made: progress.advance(bar, made.textures)


def _lines(total: int, show: Callable[[str], None]) -> Callable[["ShardResult"], None]:
    began, done = time.monotonic(), 0

    def told(made: "ShardResult") -> None:
        nonlocal done
        done += made.textures
        shard = "a shard given up" if made.shard is None else f"shard {made.shard.number}"
        show(f"{shard}: {done} of {total} textures, {time.monotonic() - began:.0f} s")

    return told
