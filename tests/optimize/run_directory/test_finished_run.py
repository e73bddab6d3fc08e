"""A finished run is read whole, and each part that is missing is named in one line."""

from pathlib import Path

import numpy as np
import pytest

from optimize.run_directory import results
from optimize.run_directory.finished_run import FinishedRun, name_of, read_result
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError
from relief.relief import Relief
from tests.visual.scenes import hills

WIDTH_MM = 14.0
"""Width that nothing but the result says."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run directory with settings and a result, but no verification; the texture knows no width."""
    np.save(tmp_path / "hills.npy", hills(0.6))
    folder = tmp_path / "run"
    folder.mkdir()
    results.write_settings(folder, run_from_scene("studio", tmp_path / "hills.npy", ["touch.jnd=1"]))
    results.write_relief(folder, Relief(hills(0.9), WIDTH_MM))
    return folder


def test_original_and_result_are_reliefs_of_one_plate(folder: Path) -> None:
    run = FinishedRun.read(folder)
    assert name_of(folder / "heights.exr") == "run"
    np.testing.assert_allclose(run.result.heights, hills(0.9), atol=1e-6)
    np.testing.assert_array_equal(run.original.heights, hills(0.6))
    assert run.original.surface == run.result.surface and run.result.width_mm == WIDTH_MM
    assert run.repeating(None) is run and run.repeating("x").settings.axes_repeat == (False, True)


def test_a_run_with_a_printer_began_with_a_print(folder: Path) -> None:
    run = FinishedRun.read(folder)
    settings = ["touch.jnd=1", 'print.printer="filament"']
    printed = FinishedRun(folder, run_from_scene("studio", run.settings.texture, settings))
    assert printed.original.printer is not None


@pytest.mark.parametrize(
    ("lost", "line"),
    [
        ("run.toml", "run: a folder without run.toml; not a run directory"),
        ("heights.exr", r"run/heights\.exr: no such file; the run has no result yet"),
    ],
)
def test_what_is_no_finished_run_is_refused(folder: Path, lost: str, line: str) -> None:
    (folder / lost).unlink()
    with pytest.raises(InputError, match=line):
        FinishedRun.read(folder)


def test_a_damaged_verification_and_moved_files_leave_the_result(folder: Path) -> None:
    run = FinishedRun.read(folder)
    for content in (None, "{}", "[" * 100_000):
        if content is not None:
            (folder / "result.json").write_text(content)
        with pytest.raises(InputError, match=r"result\.json: missing or damaged"):
            _ = run.verification
    (folder.parent / "hills.npy").unlink()
    with pytest.raises(InputError, match=r"hills\.npy: no such file"):
        FinishedRun.read(folder)
    assert read_result(folder).width_mm == WIDTH_MM
