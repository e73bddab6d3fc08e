"""The notebooks of the guide parse, and run from an empty folder on small reliefs."""

import ast
import json
from pathlib import Path

import pytest

from docs.site import notebooks

FILES = sorted(notebooks.FOLDER.glob("*.ipynb"))
SAMPLES = 32
"""Side of the reliefs, for the time."""


def name_of(file: Path) -> str:
    return file.stem


@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_cells_parse_and_one_says_how_finely_reliefs_are_sampled(file: Path) -> None:
    cells = ["".join(cell["source"]) for cell in json.loads(file.read_text("utf-8"))["cells"]]
    assert cells[0].startswith("# ")
    assert sum(notebooks.SIZE in cell for cell in cells) == 1
    for cell in notebooks.code_of(json.loads(file.read_text("utf-8"))):
        ast.parse("".join(cell["source"]))


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=name_of)
def test_a_notebook_runs_from_an_empty_folder(file: Path) -> None:
    executed, _ = notebooks.execute(file, SAMPLES)
    assert all(cell["execution_count"] for cell in notebooks.code_of(executed))
