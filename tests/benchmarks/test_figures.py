"""Figures of README and guide are the results that their comments name."""

import re
from pathlib import Path

import pytest

from benchmarks.docs.figures import FIGURE, is_right, pages, written

AREA = "pressed at 9.5 mm²<!-- figures_test: median of cases/*/area, x 10 --> of skin"


@pytest.mark.parametrize("page", pages(), ids=lambda page: page.stem)
def test_figures_are_results(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert [figure[0] for figure in FIGURE.finditer(text) if not is_right(figure)] == []
    assert len(re.findall(r"<!-- [\w/-]+: ", text)) == len(FIGURE.findall(text)), "a figure without a number"


@pytest.mark.parametrize(
    ("area", "text"), [(0.95, "9.5"), (0.953, "9.5"), (0.96, "9.6"), (12.0, "120.0")], ids=str
)
def test_a_figure_is_written_with_its_digits(area: float, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    results = {"cases": {"one": {"area": area}, "two": {"area": area}}}
    monkeypatch.setattr("benchmarks.docs.figures.load", {"figures_test": results}.__getitem__)
    found = FIGURE.search(AREA)
    assert found is not None
    assert is_right(found) == (text == "9.5")
    assert FIGURE.sub(written, AREA) == AREA.replace("9.5", text)


@pytest.mark.parametrize(
    ("number", "value", "right"),
    [
        ("40", 37.2, True),
        ("37", 37.2, True),
        ("38", 37.2, False),
        ("1,600", 1571.0, True),
        ("+2.0", 1.97, True),
    ],
)
def test_zeros_at_the_end_may_be_rounded(
    number: str, value: float, right: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.docs.figures.load", lambda name: {name: value})
    found = FIGURE.search(f"{number} s<!-- some: some -->")
    assert found is not None
    assert is_right(found) == right


def test_a_result_that_is_not_there_is_named() -> None:
    found = FIGURE.search("3 s<!-- app: no such key -->")
    assert found is not None
    with pytest.raises(ValueError, match="no such key"):
        is_right(found)
