"""The Python blocks of the documentation run as they stand; their own assertions say what comes out."""

import re
from pathlib import Path

import pytest

from retouch.commands.main import main

DOCS = Path(__file__).parents[1] / "docs"


def run_blocks(page: str, names: dict[str, object]) -> int:
    """Run the Python blocks of a page one after another in one namespace; returns how many there are.

    Blocks are padded with blank lines, so that the lines of a traceback are those of the page.
    """
    text = (DOCS / page).read_text(encoding="utf-8")
    blocks = list(re.finditer(r"^```python\n(.*?)^```", text, re.M | re.S))
    for block in blocks:
        lines_before = text.count("\n", 0, block.start(1))
        exec(compile("\n" * lines_before + block[1], str(DOCS / page), "exec"), names)
    return len(blocks)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
def test_the_guide_for_scripts() -> None:
    assert run_blocks("python.md", {}) >= 10


@pytest.mark.slow
def test_reading_a_data_set() -> None:
    made = "dataset -o data --count 4 --touch layer --lights none --workers 1"
    assert main(made.split()) == 0
    names: dict[str, object] = {}
    assert run_blocks("learned.md", names) == 1
    assert names["heights"].shape == names["strain"].shape  # type: ignore[attr-defined]
