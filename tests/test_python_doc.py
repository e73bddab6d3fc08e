"""The Python blocks of the documentation run as they stand; their own assertions say what comes out."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relief.heightmap import save_heights_png
from retouch.commands.main import main

ROOT = Path(__file__).parents[1]
SHORT_RUN = """scene = "studio.xml"
define.resolution = 16
texture = "gravel.png"
look.model = "heights"
touch.jnd = 2.0
touch.model = "quick"
verify.model = "layer"
verify.samples = 4
verify.baseline = false
descent.steps = 1
"""
"""A run file of a second, in place of `gravel`, which takes a quarter of a minute."""


def run_blocks(page: str, names: dict[str, object]) -> int:
    """Run the Python blocks of a page one after another in one namespace; returns how many there are.

    Blocks are padded with blank lines, so that the lines of a traceback are those of the page.
    """
    text = (ROOT / page).read_text(encoding="utf-8")
    blocks = list(re.finditer(r"^```python\n(.*?)^```", text, re.M | re.S))
    for block in blocks:
        lines_before = text.count("\n", 0, block.start(1))
        exec(compile("\n" * lines_before + block[1], str(ROOT / page), "exec"), names)
    return len(blocks)


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty working directory."""
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
@pytest.mark.sentinel
def test_the_readme() -> None:
    save_heights_png(Path("stone.png"), np.random.default_rng(0).random((64, 64)), None)
    Path("gravel").write_text(SHORT_RUN)
    names: dict[str, Any] = {}
    assert run_blocks("README.md", names) == 1
    assert names["pictures"].shape == (3, 128, 128) and names["result"].heights.shape == (128, 128)
    assert (Path("runs/gravel") / "report.html").is_file()


@pytest.mark.slow
def test_the_guide_for_scripts() -> None:
    assert run_blocks("docs/howto/python.md", {}) >= 10


@pytest.mark.slow
def test_reading_a_data_set() -> None:
    made = "dataset -o data --count 4 --touch layer --lights none --workers 1"
    assert main(made.split()) == 0
    names: dict[str, object] = {}
    assert run_blocks("docs/howto/surrogates.md", names) == 1
    assert names["heights"].shape == names["strain"].shape  # type: ignore[attr-defined]
