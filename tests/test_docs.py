"""The docs write the command in one way, and each command in them is one that the parser takes."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from retouch.commands.main import parse

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def blocks(page: Path) -> Iterator[str]:
    """The text of each block of code: between fences, or set in by four spaces."""
    text = page.read_text(encoding="utf-8")
    fenced = r"^```[^\n]*\n(.*?)^```"
    yield from re.findall(fenced, text, re.DOTALL | re.MULTILINE)
    yield from re.findall(
        r"(?:^ {4}[^\n]*\n)+", re.sub(fenced, "", text, flags=re.DOTALL | re.MULTILINE), re.M
    )


def commands(page: Path) -> list[str]:
    """Lines of the blocks that call the command, and calls within a line of text."""
    lines = [line.strip().removeprefix("$ ") for block in blocks(page) for line in block.splitlines()]
    return [line for line in lines if line.startswith("retouch ")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_each_command_is_one_that_the_parser_takes(page: Path) -> None:
    for command in commands(page):
        arguments = shlex.split(command, comments=True)[1:]
        assert parse(arguments).verb == arguments[0], command


def test_the_first_texture_has_its_commands() -> None:
    verbs = [command.split()[1] for command in commands(ROOT / "README.md")]
    assert verbs[:4] == ["prepare", "evaluate", "optimize", "compare"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_the_command_is_written_in_one_way(page: Path) -> None:
    assert not re.search(r"python -m (optimize|retouch)|bin/retouch", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_each_link_leads_to_a_file_and_to_a_heading_of_it(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if target.startswith(("http://", "https://")):
            continue
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        assert file.is_file(), target
        assert not anchor or anchor in anchors(file), target
