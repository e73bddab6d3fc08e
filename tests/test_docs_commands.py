"""The commands of the docs: their files are there when they are needed, and those that are quick work.

A page is read from top to bottom, as a user types it. What a user has before, such as a photograph, stands in
`GIVEN`. Commands run in the process of the tests, in a folder of the page.
"""

import os
import re
import shlex
import shutil
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_scenes import bundled
from mitsuba_scenes.studies import PUBLISHED, STUDIES
from relief.ground.formats import HEIGHT_MAPS
from relief.solids.objects.table import OBJECTS
from retouch.commands.main import main, parse

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
GIVEN = (
    *("stone.jpg", "logo.png", "my-study.toml", "~/materials"),
    *("grip.3mf", "knob.3mf", "case.3mf", "button.3mf"),
    *("fine.ini", "process.json", "grip.gcode", "grip-fuzzy.gcode"),
    *("answers.csv", "answers-rougher.csv", "press.csv"),
    *("print.stl", "coupon-scan.stl", "scan.tif", "surface.plu", "fingertip.stl"),
)
"""Files and folders that a user has before the first command of a page."""
STONE = "runs/stone"
"""The run of the README, which other pages go on with."""
OTHER_COMMANDS = ("runs/optimised",)
"""Folders that commands in the docs make which are no `retouch`."""
KNOWN_BEFORE = ("README.md", "docs/index.md")
"""Pages whose runs every page may go on with."""
SHORT = {
    "prepare": "",
    "export": "",
    "doctor": "",
    "evaluate": "",
    "wrap": "",
    "compare": "-D resolution=16",
    "render": "",
    "optimize": "--no-baseline -D resolution=16 --set look.model=heights --set touch.model=quick "
    "--set verify.model=layer --set verify.samples=4 --set descent.steps=1 --set touch.spacing_mm=10",
}
"""Verbs of which every command is run, with the options that make it short: a small picture, one step, and
fingers 10 mm apart, of which a bundled tile has one.
A run that no command of its page goes on with is a `--dry-run`, and `wrap` makes previews alone."""
PART = "benchmarks/objects/guide/button.3mf"
"""The part of the guide whose preview takes the least time."""
SLOW = ("reach", "finger")
"""Options with which a command is not run: it takes over ten seconds, however small the picture."""
STEPS_LEFT = 3
"""Exit status of a short run: it ended short of its target."""


def path_of(page: Path) -> str:
    """A page by its path in the repository; two pages are called `README.md`."""
    return str(page.relative_to(ROOT))


def downloads(page: Path) -> list[Path]:
    """The files that a reader of a page gets from it: photographs, tables of answers, parts."""
    links = re.findall(r"\]\(([^)\s#]+\.(?:jpg|csv|3mf))\)", page.read_text(encoding="utf-8"))
    return [(page.parent / link).resolve() for link in links]


@dataclass(frozen=True)
class Command:
    """A command of a page: its words after `retouch`, and the line that is shown below it."""

    words: tuple[str, ...]
    shown: str

    @cached_property
    def parsed(self) -> Namespace:
        return parse(list(self.words))


@cache
def commands(page: Path) -> list[Command]:
    """The commands of the blocks of a page, in its order; blocks are fenced or set in by four spaces."""
    found, fenced, lines = list[Command](), False, page.read_text(encoding="utf-8").splitlines()
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or line.startswith("    "):
            text = line.strip().removeprefix("$ ")
            if text.startswith("retouch "):
                found.append(Command(tuple(shlex.split(text, comments=True)[1:]), below))
    return found


def inputs(parsed: Namespace) -> Iterator[str]:
    """The files and folders that a command reads."""
    for name, value in vars(parsed).items():
        for each in value if isinstance(value, list) else [value]:
            if isinstance(each, Path) and name not in ("out", "preview"):
                yield str(each)
    for region in getattr(parsed, "region", ()):
        tile = region.rpartition("=")[2]
        if tile[0] not in "+-":
            yield tile


def output(parsed: Namespace) -> str | None:
    """The file or folder that a command makes."""
    if getattr(parsed, "out", None) is not None:
        return str(parsed.out)
    named = getattr(parsed, "source", None) or getattr(parsed, "study", None)
    return f"runs/{named.stem}" if named is not None else None


def comes_with_retouch(name: str) -> bool:
    return (
        bundled(name, ".xml", ".toml", *HEIGHT_MAPS) is not None
        or (STUDIES / f"{name}.toml").is_file()
        or name in (*OBJECTS, PUBLISHED.name)
    )


@pytest.mark.parametrize("page", PAGES, ids=path_of)
def test_what_a_command_reads_was_made_before_it(page: Path) -> None:
    before = [other for other in PAGES if path_of(other) in KNOWN_BEFORE and other != page]
    others = [one for other in before for one in commands(other)]
    given = (*GIVEN, *(file.name for file in downloads(page)))
    made = [*given, *OTHER_COMMANDS, *filter(None, (output(one.parsed) for one in others))]
    for command in commands(page):
        parsed = command.parsed
        for name in inputs(parsed):
            there = comes_with_retouch(name) or any(Path(name).is_relative_to(each) for each in made)
            assert there, f"{name} of {shlex.join(command.words)}: no command of the page makes it before"
        made += filter(None, [output(parsed)])


NOT_RUN = ("docs/howto/objects.md", "docs/explanation/verification.md")
"""Pages whose commands all take over ten seconds: they read what `wrap` makes, or mesh a fingertip."""
PAGES_TO_RUN = [
    page
    for page in PAGES
    if path_of(page) not in NOT_RUN
    and any(command.words[0] in (*SHORT, "study") for command in commands(page))
]


@pytest.fixture(scope="module")
def stone(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a short run like that of the README."""
    folder = tmp_path_factory.mktemp("stone") / "stone"
    options = ["-q", "--jnd", "2", "-o", str(folder), *shlex.split(SHORT["optimize"])]
    assert main(["optimize", "leather", *options]) == STEPS_LEFT
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES_TO_RUN, ids=path_of)
def test_quick_commands_work(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    monkeypatch.chdir(tmp_path)
    grey = np.random.default_rng(0).integers(0, 256, (48, 64), np.uint8)
    Image.fromarray(grey).save("stone.jpg")
    for file in (ROOT / PART, *downloads(page)):
        shutil.copy(file, ".")
    # What the scan of a coupon, which takes over ten seconds, makes.
    Path("mine.toml").write_text("pixel_um = 50\nlayer_um = 50\n")
    read = [Path(name) for one in commands(page) for name in inputs(one.parsed)]
    made_here = STONE in (output(one.parsed) for one in commands(page))
    if any(name.is_relative_to(STONE) for name in read) and not made_here:
        shutil.copytree(request.getfixturevalue("stone"), STONE)
    ran = 0
    for command in commands(page):
        parsed = command.parsed
        verb = command.words[0]
        quick = verb in SHORT or (verb == "study" and parsed.list)
        there = all(comes_with_retouch(name) or os.path.exists(name) for name in inputs(parsed))
        slow = any(getattr(parsed, option, False) for option in SLOW) or (verb == "wrap" and parsed.out)
        # Prints of tiles are pressed at many places.
        tile = getattr(parsed, "repeats", False) or any(name.endswith("-tile") for name in inputs(parsed))
        slow = slow or (verb == "evaluate" and parsed.printer and tile)
        if not quick or not there or slow:
            continue
        refused = command.shown.startswith("retouch: ")
        short = SHORT.get(verb, "")
        if verb == "optimize" and not any(name.is_relative_to(str(output(parsed))) for name in read):
            # Nothing on the page goes on with the run: everything about it is checked, and nothing computed.
            short += " --dry-run"
        status = main([*command.words, *shlex.split(short)])
        allowed = {2} if refused else {0, STEPS_LEFT} if verb == "optimize" else {0}
        assert status in allowed, command
        ran += 1
    assert ran


def test_the_pages_have_commands_of_each_kind() -> None:
    verbs = {command.words[0] for page in PAGES for command in commands(page)}
    assert verbs >= {"prepare", "evaluate", "optimize", "compare", "render", "study", "dataset", "train"}
