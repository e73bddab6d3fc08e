"""The study files of the benchmarks say runs that can be begun, and those that the scripts look for."""

from pathlib import Path

import pytest

from benchmarks.prints.pairs import names
from benchmarks.shared.common import ROOT, load
from benchmarks.surfaces import fingers, varied
from retouch.laboratory.studies.rows import Expanded, expand
from retouch.laboratory.studies.study_file import load_study

FOLDER = ROOT / "benchmarks"
WHOLE = {
    "surfaces/fingers": 18,
    "prints/pairs": 21,
    "objects/tiles": 22,
}
"""Rows of the studies whose textures come with Retouch."""


def expanded(name: str) -> Expanded:
    return expand(load_study(FOLDER / f"{name}.toml"))


@pytest.mark.parametrize("name", WHOLE)
def test_every_row_is_sound(name: str) -> None:
    found = expanded(name)
    assert not found.faults
    assert sum(len(table.rows) for table in found.tables) == WHOLE[name]
    assert expand(load_study(FOLDER / f"{name}.toml"), quick=True).tables


def test_strips_are_sound_once_their_textures_are_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(varied, "TEXTURES", tmp_path / "runs" / "varied" / "textures")
    varied.write_textures()
    folder = tmp_path / "benchmarks" / "surfaces"
    folder.mkdir(parents=True)
    for name in ("varied.toml", "strip.toml"):
        (folder / name).write_text((FOLDER / "surfaces" / name).read_text())
    found = expand(load_study(folder / "varied.toml"))
    assert not found.faults
    labels = [row.labels["case"] for row in found.tables[0].rows]
    assert set(labels) == load("varied").keys() - {"machine"}


def test_the_rows_have_the_names_of_the_results() -> None:
    assert set(names()) == load("prints").keys()
    cases = {row.labels["case"] for row in expanded("surfaces/fingers").tables[0].rows}
    assert cases == set(fingers.CASES)
    tiles = {row.labels["tile"] for row in expanded("objects/tiles").tables[0].rows}
    assert tiles == load("paper_objects")["tiles"].keys()
