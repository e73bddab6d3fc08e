"""The page on extending names files and tables that are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
FILES = sorted(set(re.findall(r"`([a-z_]+/[\w./]*)`", PAGE)))
TABLES = sorted(set(re.findall(r"`([A-Z]+)` in `([\w/.]+)`", PAGE)))


@pytest.mark.parametrize("file", FILES)
def test_each_file_is_there(file: str) -> None:
    assert (ROOT / file).exists()


@pytest.mark.parametrize(("table", "file"), TABLES)
def test_each_table_is_in_its_file(table: str, file: str) -> None:
    assert re.search(rf"^{table}\b.* = ", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)


def test_the_page_names_them() -> None:
    assert len(FILES) >= 20
    assert len(TABLES) >= 9
