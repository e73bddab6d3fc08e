"""Two reliefs beside one another: the numbers are those of the other verbs, and the page stands alone."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import retouch
from mitsuba_scenes import find_file
from optimize.run_directory import results
from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.run_file import run_from_scene
from optimize.verification.picture_metrics import pixels_per_degree
from relief.ground.errors import InputError
from relief.ground.formatting import OBEYED
from relief.heightmap import save_heights_exr
from relief.relief import Relief
from retouch.commands.main import main
from tests.retouch.pages.outline import Outline
from tests.visual.scenes import sun, write_scene

SMALL = ("-D", "resolution=32", "-D", "texture=waves.exr", "--samples", "4")


def relief(side: int, height_mm: float) -> np.ndarray:
    """Smooth waves over the plate, from 0 to a height."""
    at = (np.arange(side) + 0.5) / side
    return 0.25 * height_mm * (2 + np.sin(8 * np.pi * at)[:, None] + np.cos(6 * np.pi * at)[None, :])


@pytest.fixture(autouse=True)
def _reliefs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty working directory, waves of two heights, on a finer grid, and on a smaller plate."""
    monkeypatch.chdir(tmp_path)
    save_heights_exr("waves.exr", relief(32, 0.6), 10.0)
    save_heights_exr("taller.exr", relief(32, 0.9), 10.0)
    save_heights_exr("finer.exr", relief(64, 0.6), 10.0)
    save_heights_exr("smaller.exr", relief(32, 0.6), 5.0)


def compared(capsys: pytest.CaptureFixture[str], *argv: str) -> dict[str, Any]:
    """What a comparison prints as JSON."""
    assert main(["compare", *argv, *SMALL, "-q", "--json"]) == 0
    printed = capsys.readouterr()
    assert printed.err == ""
    found: dict[str, Any] = json.loads(printed.out)
    return found


def page(path: Path = Path("comparison.html")) -> tuple[str, Outline]:
    """The text of a page that asks nothing of a network, and its outline."""
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"https?://|url\(|@import|<link|<iframe", text)
    outline = Outline(text)
    assert outline.open == [] and outline.handlers == []
    assert all(link.startswith("data:image/png;base64,") for link in outline.fetched)
    for leftover in ("{{", "{%", "None", "nan", "Undefined"):
        assert leftover not in outline.text
    return " ".join(outline.text.split()), outline


@pytest.mark.slow
def test_two_textures_differ_as_evaluate_says(capsys: pytest.CaptureFixture[str]) -> None:
    found = compared(capsys, "waves.exr", "taller.exr", "--distance-cm", "80")
    assert main(["evaluate", "waves.exr", "taller.exr", "--json"]) == 0
    one, other = json.loads(capsys.readouterr().out)
    for side, entry in ((found["first"], one), (found["second"], other)):
        assert all(side[key] == entry[key] for key in ("roughness", "contact_area_mm2", "contact_fraction"))
    assert found["jnd_apart"] == other["jnd_from_first"] > 0.0
    assert found["told_apart_probability"] == retouch.discrimination_probability(found["jnd_apart"])
    look = found["look"]
    assert look["change_percent"] > 0.0 and look["conditions"] == ["light-10", "light-130", "light-250"]
    assert look["pixels_per_degree"] == pytest.approx([pixels_per_degree(3.2, 80.0)] * 3)
    assert all(0.0 < flip < 1.0 for flip in look["flip"])
    text, outline = page()
    for words in ("waves and taller", "To a finger B is", "rougher than A", "Blink A and B", "DSSIM", "FLIP"):
        assert words in text
    assert outline.tags.count("script") == 2  # heights of the figure whose lamp moves, and the program


@pytest.mark.slow
def test_a_relief_differs_from_itself_by_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    found = compared(capsys, "waves.exr", "waves.exr")
    assert (found["jnd_apart"], found["told_apart_probability"]) == (0.0, 0.5)
    assert found["look"]["noise"]["certainty"] == "same" and found["look"]["change_percent"] == 0.0
    text, _ = page()
    assert "To a finger the same, to the eye the same." in text and "differ by 0.0 µm" in text


@pytest.mark.slow
def test_grids_of_two_kinds_are_compared_where_the_plates_agree(capsys: pytest.CaptureFixture[str]) -> None:
    found = compared(capsys, "waves.exr", "finer.exr")
    assert [found[side]["samples"] for side in ("first", "second")] == [32, 64]
    assert abs(found["jnd_apart"]) < 0.5
    # The same waves: what differs between the pictures is the grid of the finer ones.
    assert 0.0 < found["look"]["change_percent"] < 5.0
    assert "averaged to the samples of the coarser ones" in page()[0]


@pytest.mark.slow
def test_the_film_of_the_finer_grid_is_that_of_both() -> None:
    """The film grows with the samples, from 16 pixels here."""
    studio = find_file("studio", ".xml").read_text().replace("textures/gravel.png", "waves.exr")
    Path("small.xml").write_text(studio.replace('"resolution" value="128"', '"resolution" value="16"'))
    found = retouch.compare("waves.exr", "finer.exr", "page.html", scene="small.xml", samples=4)
    assert 0.0 < found["look"]["change_percent"] < 20.0
    page(Path("page.html"))


def test_plates_of_two_depths_are_compared_by_touch_alone(capsys: pytest.CaptureFixture[str]) -> None:
    save_heights_exr("deep.exr", relief(64, 0.6)[:, :32], 10.0)
    found = compared(capsys, "waves.exr", "deep.exr")
    assert found["no_look"].startswith("A is 10 x 10 mm and B is 10 x 20 mm")
    assert "no map of the change" in page()[0]


@pytest.mark.slow
def test_plates_of_two_sizes_are_compared_by_touch_alone(capsys: pytest.CaptureFixture[str]) -> None:
    found = compared(capsys, "waves.exr", "smaller.exr")
    assert found["look"] is None and found["scene"] is None and found["jnd_apart"] < 0.0
    assert found["no_look"].startswith("A is 10 x 10 mm and B is 5 x 5 mm")
    text, outline = page()
    assert found["no_look"] in text and "no map of the change" in text
    assert len([tag for tag in outline.tags if tag == "img"]) == 8


def test_a_scene_of_another_size_shows_no_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    found = compared(capsys, "smaller.exr", "smaller.exr", "-D", "size_mm=10")
    assert found["look"] is None and "plate of studio.xml is 10 mm wide" in found["no_look"]


def finished(folder: Path, *more: str) -> FinishedRun:
    """A run directory with what a comparison reads of it, of a softer skin."""
    settings = run_from_scene(
        "studio",
        "waves.exr",
        ["touch.jnd=1", "touch.young_modulus_mpa=0.4", "seed=7", "define.resolution=32", *more],
    )
    folder.mkdir()
    results.write_settings(folder, settings)
    taller = Relief(relief(32, 0.9), 10.0)
    printer = settings.print.described
    results.write_relief(folder, taller if printer is None else taller.printed(printer))
    return FinishedRun.read(folder)


@pytest.mark.slow
def test_a_run_is_compared_with_its_original(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    finished(tmp_path / "run")
    found = compared(capsys, "run")
    assert (found["first"]["file"], found["second"]["file"]) == (
        str(tmp_path / "waves.exr"),
        "run/heights.exr",
    )
    assert found["skin"]["young_modulus_mpa"] == 0.4 and found["jnd_apart"] > 0.0
    text, _ = page()
    assert "run: original and result" in text and "the result is" in text
    both = compared(capsys, "waves.exr", "run")
    assert both["look"] == found["look"] and both["second"]["name"] == "B"


@pytest.mark.slow
def test_of_a_run_with_a_printer_both_prints_are_compared(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = finished(tmp_path / "run", 'print.printer="filament"')
    found = compared(capsys, "run")
    sides = (found["first"], found["second"])
    assert [(side["printer"], side["samples"], side["rows"]) for side in sides] == [("filament", 25, 25)] * 2
    text, _ = page()
    assert text.count("as printed (filament)") == 2 and "original and result" in text
    # The numbers are those of the two prints, which the run compares.
    save_heights_exr("print.exr", run.original.heights, 10.0)
    assert compared(capsys, "print.exr", "run")["look"] == found["look"]
    assert main(["compare", "run", *SMALL]) == 0
    assert capsys.readouterr().out.count("25 x 25, as printed (filament)") == 2


@pytest.mark.slow
def test_the_screen_tells_touch_and_sight(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "waves.exr", "taller.exr", *SMALL, "-o", "both.html"]) == 0
    printed = capsys.readouterr()
    for words in (
        "JND rougher than A, told apart in",
        "to 5 fingers",
        "of the mean picture",
        "FLIP",
        "both.html",
    ):
        assert words in printed.out


@pytest.mark.slow
def test_a_script_compares_without_a_page(tmp_path: Path) -> None:
    found = retouch.compare("waves.exr", "smaller.exr")
    assert found["look"] is None and "page" not in found
    assert not list(tmp_path.glob("*.html"))
    small = {"resolution": "32", "texture": "waves.exr"}
    look = retouch.compare("waves.exr", "taller.exr", defines=small)["look"]
    assert look["samples"] >= 64 and look["noise"]["certainty"] in ("known", "coarse")


@pytest.mark.parametrize(
    ("argv", "line"),
    [
        (["waves.exr"], "waves.exr: not a run directory"),
        (["waves.exr", "."], ".: a folder without run.toml; not a run directory"),
        (["waves.exr", "missing.exr"], "missing.exr: no such file"),
        (["waves.exr", "taller.exr", "-o", "none/page.html"], "none/page.html: -o: there is no folder none"),
        (["waves.exr", "taller.exr", "-o", "taller.exr"], "taller.exr: -o: the page is HTML"),
        (["waves.exr", "taller.exr", "-o", "."], ".: -o: is a folder"),
        (["waves.exr", "taller.exr", "--relief-mm", "1"], "--relief-mm: is for pictures"),
        (
            ["waves.exr", "taller.exr", "--distance-cm", "0"],
            "--distance-cm: 0 is not a number from 5 to 1000",
        ),
        ([".", ".", "--size-mm", "10"], "--size-mm: is for textures"),
    ],
)
def test_bad_input_is_one_line(argv: list[str], line: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", *argv]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"retouch: {line}") and error.count("\n") == 1


def test_a_run_without_a_result_is_named(tmp_path: Path) -> None:
    (finished(tmp_path / "run").folder / "heights.exr").unlink()
    with pytest.raises(InputError, match=r"heights\.exr: no such file; the run has no result yet"):
        retouch.compare(tmp_path / "run")


def test_a_scene_whose_pictures_are_black_is_refused(tmp_path: Path) -> None:
    write_scene(tmp_path, relief(32, 0.6), [sun(-40)])
    with pytest.raises(InputError, match=r"scene\.xml: its pictures are black"):
        retouch.compare("waves.exr", "taller.exr", scene="scene.xml", samples=4)


@pytest.mark.slow
def test_the_name_of_a_file_stays_a_name() -> None:
    hostile = "<img src=x onerror=alert(1)>\x1b[2J\u202e.npy"
    np.save(hostile, relief(32, 0.6))
    retouch.compare(
        "waves.exr", hostile, "page.html", scene="studio", samples=4, defines={"resolution": "16"}
    )
    text, _ = page(Path("page.html"))
    assert "<img src=x onerror=alert(1)>?[2J?.npy" in text and not OBEYED.search(text)
