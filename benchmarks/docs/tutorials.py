"""The commands of start page and tutorials, each page from an empty folder: CPU seconds and what is printed.

python -m benchmarks.docs.tutorials                # all pages: about ten CPU minutes
python -m benchmarks.docs.tutorials print people   # these alone

A page has the files that it links to, as a reader has who downloads them. `app` and `--serve`, which wait for
a person, are left out. The answers that people.md offers are those of eight simulated people to its plan:

python -m benchmarks.docs.tutorials --simulate SET
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import DOCS, load, machine, parser_of, save
from benchmarks.shared.processes import process
from relief.ground.files import write_atomically
from retouch.laboratory.people.plan import write_plan
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.reading import ROUGHER
from retouch.laboratory.stimulus_sets.stimulus_set import FILE, StimulusSet

PAGES = {path.stem: path for path in (DOCS / "start.md", *sorted((DOCS / "tutorials").glob("*.md")))}
ANSWERS = DOCS / "tutorials" / "answers-simulated.csv"
LEFT_OUT = {"settings", "noise", "findings"}
"""Keys of results that no page shows."""
NAMES = ("texture", "label", "person", "name")
"""Keys by which entries of lists are named."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("pages", nargs="*", help=f"of: {', '.join(PAGES)}")
    parser.add_argument("--simulate", type=Path, metavar="SET", help="write the answers to this set")
    arguments = parser.parse_args()
    if arguments.simulate is not None:
        simulate(arguments.simulate)
        return
    for name in arguments.pages or PAGES:
        with tempfile.TemporaryDirectory() as folder:
            rows = dict[str, Any]()
            for command, row in run(PAGES[name], Path(folder)):
                rows.setdefault(command, row)
        save("tutorials", load("tutorials") | {name: rows, "machine": machine()})


def commands(page: Path) -> list[list[str]]:
    """Words of the commands in the blocks of a page that end by themselves, in its order."""
    lines = re.findall(r"^(?:    )?(retouch .+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    each = [shlex.split(line, comments=True) for line in lines]
    return [words for words in each if words[1] != "app" and "--serve" not in words]


def run(page: Path, folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Each command by its verb and what it writes, else reads: CPU seconds, exit status and numbers."""
    for link in re.findall(r"\]\(([^)\s#]+\.(?:jpg|csv|3mf))\)", page.read_text(encoding="utf-8")):
        shutil.copy(page.parent / link, folder)
    for words in commands(page):
        named = words[words.index("-o") + 1] if "-o" in words else words[-1]
        ended = process(["-m", *words, "--json"], folder=folder)
        numbers = numbers_of(json.loads(ended.out or "{}"))
        row = {"cpu_s": round(ended.cpu_s, 1), "status": ended.status, "numbers": numbers}
        print(shlex.join(words), ended.status, f"{row['cpu_s']} CPU s", flush=True)
        yield f"{words[1]} {Path(named).name}", row


def numbers_of(value: Any) -> Any:
    """Numbers, and tables of them; of a list those of its entries that name a texture, plate or person."""
    if isinstance(value, list):
        tables = [one for one in value if isinstance(one, dict)]
        key = next((key for key in NAMES if tables and key in tables[0]), None)
        value = {Path(one[key]).stem: one for one in tables} if key is not None else {}
    if not isinstance(value, dict):
        return value if isinstance(value, int | float) else None
    kept = {key: numbers_of(one) for key, one in value.items() if key not in LEFT_OUT}
    return {key: one for key, one in kept.items() if one is not None and one != {}}


def simulate(folder: Path) -> None:
    """Answer "which is rougher?" of a set's plan by people whose JND is 0.19 by median, with 2 % lapses."""
    rng, plates = np.random.default_rng(1), read_plates(folder)
    plan = write_plan(folder, StimulusSet.read(folder / FILE).experiment)
    assert plan is not None
    noise = {name: math.log1p(0.19 * math.exp(0.2 * rng.standard_normal())) for name in plan.trials[ROUGHER]}
    headings, *rows = plan.rows(ROUGHER)
    for row in rows:
        person, _, first, second, _ = row
        if rng.random() < 0.02:
            row[-1] = second if rng.random() < 0.5 else first
        else:
            felt = math.log(plates[second].roughness / plates[first].roughness)
            row[-1] = second if felt + noise[person] * rng.standard_normal() > 0.0 else first
    text = io.StringIO()
    csv.writer(text).writerows([headings, *rows])
    write_atomically(ANSWERS, text.getvalue().encode())


if __name__ == "__main__":
    main()
