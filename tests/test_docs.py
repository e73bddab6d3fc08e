"""The docs write the command in one way, and each command in them is one that the parser takes."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest

from retouch.commands.main import parse

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
EVIDENCE = DOCS / "evidence"
PAGES = [*sorted(ROOT.glob("*.md")), *sorted(DOCS.rglob("*.md"))]
MOST_WORDS = 25_000
"""Of a page of evidence."""
CODE = ("*.py", "*.toml", "*.xml", "*.html")


def path_of(page: Path) -> str:
    """A page by its path in the repository; two pages are called `README.md`."""
    return str(page.relative_to(ROOT))


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


@pytest.mark.parametrize("page", PAGES, ids=path_of)
def test_each_command_is_one_that_the_parser_takes(page: Path) -> None:
    for command in commands(page):
        arguments = shlex.split(command, comments=True)[1:]
        assert parse(arguments).verb == arguments[0], command


def test_the_first_texture_has_its_commands() -> None:
    verbs = [command.split()[1] for command in commands(ROOT / "README.md")]
    assert verbs[:4] == ["prepare", "evaluate", "optimize", "compare"]


@pytest.mark.parametrize("page", PAGES, ids=path_of)
def test_no_line_of_text_starts_with_a_sign_of_markup(page: Path) -> None:
    """MyST takes a percent sign at the start of a line for a comment, a plus for an item of a list."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    assert not re.findall(r"^[ >]*[%+](?: .*|[^ ]*)$", text, re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=path_of)
def test_the_command_is_written_in_one_way(page: Path) -> None:
    assert not re.search(r"python -m (optimize|retouch)|bin/retouch", page.read_text(encoding="utf-8"))


def anchors(page: Path) -> set[str]:
    """The anchors that GitHub gives the headings of a page."""
    headings = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=path_of)
def test_each_link_leads_to_a_file_and_to_a_heading_of_it(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if target.startswith(("http://", "https://")):
            continue
        name, _, anchor = target.partition("#")
        file = page.parent / name if name else page
        assert file.is_file(), target
        assert not anchor or anchor in anchors(file), target


def links(page: Path) -> set[Path]:
    """The files of the repository that a page links to."""
    targets = re.findall(r"\]\(([^)\s#]+)", page.read_text(encoding="utf-8"))
    return {(page.parent / target).resolve() for target in targets if "://" not in target}


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    named = re.findall(r"^(?!```|:)(\S+)$", (DOCS / "site" / "navigation.txt").read_text("utf-8"), re.M)
    pages = [(DOCS / f"{name}{suffix}").resolve() for name in named for suffix in (".md", ".ipynb")]
    here = {DOCS / "index.md", *(page for page in pages if page.is_file())}
    assert len(here) == len(named) + 1
    assert {*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")} <= here


def test_the_index_of_the_evidence_has_a_line_for_each_page() -> None:
    lines = re.findall(
        r"^\* \[(\w+)\]\((\w+)\.md\): \w", (DOCS / "evidence" / "README.md").read_text("utf-8"), re.M
    )
    assert sorted(page for _, page in lines) == sorted(
        page.stem for page in EVIDENCE.glob("*.md") if page.stem != "README"
    )


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=path_of)
def test_a_page_opens_with_its_title(page: Path) -> None:
    assert re.match(r"# .+[^?]\n\n", page.read_text(encoding="utf-8"))


@pytest.mark.parametrize("page", sorted(EVIDENCE.glob("*.md")), ids=path_of)
def test_a_page_of_evidence_is_not_long(page: Path) -> None:
    assert len(page.read_text(encoding="utf-8").split()) < MOST_WORDS


def test_every_picture_is_on_a_page() -> None:
    pages = [*PAGES, ROOT / "mitsuba_scenes" / "textures" / "README.md"]
    assert set((DOCS / "images").iterdir()) <= set.union(*(links(page) for page in pages))


def test_pages_that_the_code_names_are_there() -> None:
    packages = [folder for folder in ROOT.iterdir() if (folder / "__init__.py").is_file()]
    for file in (file for folder in packages for kind in CODE for file in folder.rglob(kind)):
        for page in re.findall(r"docs/[\w/]+\.md", file.read_text(encoding="utf-8")):
            assert (ROOT / page).is_file(), f"{page} in {file}"


@pytest.mark.parametrize("page", PAGES, ids=path_of)
def test_files_that_a_page_names_are_there(page: Path) -> None:
    packages = "|".join(folder.parent.name for folder in ROOT.glob("*/__init__.py"))
    for named in re.findall(rf"`((?:{packages}|tests)/[\w./]+)`", page.read_text(encoding="utf-8")):
        assert (ROOT / named).exists(), named
