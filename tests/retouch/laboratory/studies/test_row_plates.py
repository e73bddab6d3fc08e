"""Plates of rows: shared originals, samples that fit the page, and none where a row has nothing to show."""

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from optimize.run_directory import results
from optimize.settings.run_file import Run
from relief.relief import Relief
from retouch.laboratory.studies import row_plates as module
from retouch.laboratory.studies.row_plates import row_plates


@pytest.fixture
def rows(texture: Path, tmp_path: Path) -> dict[str, Path]:
    """Two runs of one texture, whose results differ."""
    folders = {name: tmp_path / name for name in ("one", "other")}
    original = Relief.read(texture)
    for factor, folder in zip((1.1, 1.2), folders.values(), strict=True):
        folder.mkdir()
        results.write_settings(
            folder, Run.model_validate({"scene": "studio.xml", "texture": texture, "touch": {"jnd": 1.0}})
        )
        results.write_relief(folder, replace(original, heights=factor * original.heights))
    return folders


def test_rows_of_one_texture_share_its_heights(rows: dict[str, Path]) -> None:
    plates = row_plates(rows)
    one, other = (plates["rows"][key]["heights"] for key in rows)
    assert one[0] == other[0] and one[1] != other[1] and len(plates["fields"]) == 3
    assert plates["options"]["lamps"] and "samples" in plates["rows"]["one"]["note"]


def test_a_row_without_its_folder_or_its_original_has_no_plates(rows: dict[str, Path]) -> None:
    (rows["other"] / "heights.exr").unlink()
    assert set(row_plates(rows | {"gone": Path("nowhere")})["rows"]) == {"one"}
    shutil.rmtree(rows["one"])
    assert row_plates(rows)["rows"] == {}


def test_many_rows_are_shown_in_fewer_samples(rows: dict[str, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    assert module._samples(10) == module.SPOT_SAMPLES > module._samples(1000) > module._samples(10**6)
    monkeypatch.setattr(module, "MOST_BYTES", 0.0)
    assert row_plates(rows)["rows"]["one"]["cols"] == 32 < module.FEWEST_SAMPLES
