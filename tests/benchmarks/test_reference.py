"""The tables of docs/reference are those of the code, and every key of a JSON document is on its page."""

import contextlib
import io
import json
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.docs.reference import REFERENCE, tables
from benchmarks.shared.common import ROOT
from relief.heightmap import save_heights_exr
from retouch.commands.main import main

PAGE = (REFERENCE / "json.md").read_text(encoding="utf-8")
PACKAGES = ("retouch", "optimize", "relief", "tactile", "surrogate")
COMMANDS = {
    "prepare": "prepare small.exr -o prepared.png --relief-mm 0.3 --json",
    "evaluate": "evaluate small.exr prepared.png --readouts --model quick --json",
    "optimize --dry-run": "optimize gravel --dry-run --json",
    "render": "render studio -D resolution=8 --samples 4 --json",
    "export": "export small.exr -o small.png --json",
    "doctor": "doctor --json",
    "compare": "compare small.exr prepared.png --samples 4 -D resolution=8 --model quick --json",
}
"""Commands whose documents take little time, by their verbs."""


@pytest.mark.parametrize(("page", "name"), tables())
def test_tables_are_current(page: str, name: str) -> None:
    text = (REFERENCE / f"{page}.md").read_text(encoding="utf-8")
    shown = text.partition(f"<!-- {name}, made by python -m benchmarks.docs.reference -->\n")[2]
    assert shown.partition(f"\n<!-- end of {name} -->")[0] == tables()[page, name]


def keys_of(text: str) -> set[str]:
    """Every key in code of a text, without the sections that it is in."""
    return {part for key in re.findall(r"`([^`]+)`", text) for part in re.split(r"[.\[\]]+", key) if part}


def test_every_key_of_a_table_is_one_of_the_code() -> None:
    code = "\n".join(file.read_text("utf-8") for each in PACKAGES for file in (ROOT / each).rglob("*.py"))
    words = set(re.findall(r"\w+", code))
    hand_made = re.sub(r"<!-- (\w+), made by.*?<!-- end of \1 -->", "", PAGE, flags=re.S)
    cells = [line.split("|")[1] for line in hand_made.splitlines() if line.startswith("| `")]
    keys = {key for cell in cells for key in keys_of(cell) if re.fullmatch(r"[a-z0-9_]+", key)}
    assert len(keys) > 60
    assert keys - words == set()


def walked(document: Any) -> Iterator[str]:
    """The names of all members of a JSON document, but of those whose names are data."""
    for entry in document if isinstance(document, list) else [document]:
        if isinstance(entry, dict):
            for key, value in entry.items():
                yield key
                if key not in ("skin", "readouts", "versions", "settings"):
                    yield from walked(value)


@pytest.mark.slow
def test_every_key_of_a_document_is_on_the_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr("small.exr", 0.3 * np.random.default_rng(0).random((32, 32)))
    known = keys_of(PAGE)
    for verb, command in COMMANDS.items():
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            assert main(shlex.split(command)) == 0, command
        found = set(walked(json.loads(printed.getvalue())))
        ends = {key for key in found if key.endswith(("_min", "_max", "_low", "_high"))}
        assert found - ends - known == set(), verb
