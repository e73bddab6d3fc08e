"""Every command of a benchmark that code and documentation name is one."""

import re
from importlib.util import find_spec
from pathlib import Path

import pytest

from benchmarks.shared.common import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
SOURCES = sorted((ROOT / "benchmarks").rglob("*.py"))
NAMED = re.compile(r"python\s+-m\s+(benchmarks(?:\.\w+)+)")


def commands(file: Path) -> set[str]:
    return set(NAMED.findall(file.read_text(encoding="utf-8")))


@pytest.mark.parametrize("file", PAGES + SOURCES, ids=lambda file: str(file.relative_to(ROOT)))
def test_named_commands_are_there(file: Path) -> None:
    for name in commands(file):
        spec = find_spec(name)
        assert spec is not None, name
        # A package is run by its __main__.
        assert spec.submodule_search_locations is None or find_spec(f"{name}.__main__") is not None, name


def test_each_module_with_a_main_says_its_command() -> None:
    """So that a module that is moved does not keep the command that it had."""
    for file in SOURCES:
        text = file.read_text(encoding="utf-8")
        name = ".".join(file.relative_to(ROOT).with_suffix("").parts)
        if '__name__ == "__main__"' in text and file.stem not in (
            "__main__",
            "in_blender",
            "read_in_blender",
        ):
            assert name in commands(file), name


def test_commands_are_found() -> None:
    assert len(set().union(*map(commands, PAGES))) > 20
