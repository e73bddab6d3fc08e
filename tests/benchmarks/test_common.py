"""Rows that are measured if they are missing or asked for, and texts in their places on pages."""

from functools import partial
from pathlib import Path

import pytest

from benchmarks.shared import common
from benchmarks.shared.common import load, parts_of, put, rows_parser, table_of


@pytest.fixture
def results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(common, "RESULTS", tmp_path / "results")


@pytest.mark.usefixtures("results")
def test_rows_are_measured_once_or_again_where_they_are_named() -> None:
    measured: list[str] = []

    def measure(row: str) -> int:
        measured.append(row)
        return len(measured)

    def asked(*words: str) -> dict[str | None, dict[str, int]]:
        measures = {row: partial(measure, row) for row in ("one", "one more", "two")}
        return parts_of(rows_parser("").parse_args(words), "some", {"rows": measures, None: {}})

    assert asked("one") == {"rows": {"one": 1, "one more": 2}, None: {}}
    assert asked()["rows"] == {"one": 1, "one more": 2, "two": 3}
    assert asked("two", "--again")["rows"]["two"] == 4
    assert measured == ["one", "one more", "two", "two"]
    assert load("some")["rows"] == {"one": 1, "one more": 2, "two": 4}
    with pytest.raises(SystemExit, match="three: is part of none of: one; one more; two"):
        asked("three")


def test_a_text_stands_between_the_comments_of_its_name(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("a\n<!-- one, made by python -m some -->\nold\n<!-- end of one -->\nz\n")
    put(page, "one", table_of("row", {"x": {"jnd": 1.234}}, {"JND": "{jnd:+.1f}"}))
    assert page.read_text().splitlines()[2:5] == ["| row | JND  |", "|-----|------|", "| x   | +1.2 |"]
    with pytest.raises(ValueError, match="has no place for two"):
        put(page, "two", "text")
