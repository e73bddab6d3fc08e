"""Palettes by the command: fills that are told apart, files, what is refused, and going on."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from benchmarks.shared.browser import Browser, chromium
from relief.heightmap import save_heights_exr
from retouch.commands.main import BAD_INPUT, main
from retouch.laboratory.studies import engine
from retouch.pages.sentences import TextTable
from retouch.verbs.palettes import palette_fills
from tests.retouch.laboratory.studies.conftest import in_process

SHORT = (
    *("--set", "verify.model=layer", "--set", "verify.samples=4", "--set", "define.resolution=32"),
    *("--set", "touch.model=quick", "--set", "look.model=fast", "--set", "touch.spacing_mm=5"),
)


@pytest.fixture(scope="module")
def tiles(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two tiles of 32 x 32 samples: hills, and finer and lower ones."""
    folder = tmp_path_factory.mktemp("tiles")
    y, x = np.meshgrid(*[2.0 * np.pi * np.arange(32) / 32] * 2, indexing="ij")
    for name, times, high in (("hills", 1, 0.25), ("knobs", 2, 0.1)):
        waves = np.sin(times * (2.0 * x + y)) + 0.6 * np.cos(times * (3.0 * y - x))
        save_heights_exr(folder / f"{name}-tile.exr", high * (waves - waves.min()), 10.0)
    save_heights_exr(folder / "slope.exr", np.linspace(0.0, 1.0, 32)[None, :] * np.ones((32, 1)), 10.0)
    return folder


@pytest.fixture
def here(tiles: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tiles)
    monkeypatch.setattr(palette_fills, "runner", lambda work, workers, dask, seen: in_process(work, seen))
    return tmp_path / "out"


@pytest.mark.slow
def test_fills_of_two_textures_are_told_apart(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    command = [
        "palette",
        "hills-tile.exr",
        "knobs-tile.exr",
        *SHORT,
        "--fills",
        "3",
        "--one-finger",
        "-o",
        str(here),
    ]
    assert main([*command, "--json"]) == 0
    printed = capsys.readouterr()
    assert "levels, JND: " in printed.err
    content: dict[str, Any] = json.loads(printed.out)
    assert len(content["fills"]) == 3 and content["short"] is None and content["fingers"] == ["this finger"]
    jnds = [fill["jnd"][0] for fill in content["fills"]]
    assert jnds == sorted(jnds) and np.diff(jnds).min() >= 2.0
    named = [fill["named_percent"] for fill in content["fills"]]
    assert content["named_percent"] == pytest.approx([np.mean(named)])
    for fill in content["fills"]:
        tile = np.asarray(Image.open(here / fill["tile"]))
        assert tile.max() > 255 and (here / fill["tile"]).with_suffix(".html").is_file()
        assert (here / fill["folder"] / "report.html").is_file()
    plates = trimesh.load_scene(here / content["print"][0])
    assert len(plates.geometry) == 3
    page = (here / "index.html").read_text()
    assert all(fill["label"] in page for fill in content["fills"]) and "by roughness alone" in page
    if chromium() is not None:
        with Browser() as browser:
            seen = browser.open(here / "index.html", 400)
            assert not seen.asked and not seen.complaints
            assert browser.evaluate("document.documentElement.scrollWidth") == 400

    monkeypatch.setattr(
        engine, "faults_of", lambda settings: pytest.fail("computed again") if settings else {}
    )
    assert main([*command, "-q"]) == 0
    assert main([*command, "--apart", "3", "-q"]) == BAD_INPUT
    assert "holds a palette with other apart; choose another -o" in capsys.readouterr().err


@pytest.mark.slow
def test_more_fills_than_there_is_room_for_are_refused(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["palette", "hills-tile.exr", *SHORT, "--fills", "16", "-q", "-o", str(here)]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "--fills: there is no room for 16 fills 2 JND apart: " in line
    assert "is the most by roughness alone" in line


@pytest.mark.parametrize(
    ("argv", "told"),
    [
        (["slope.exr"], "the sides do not fit along x"),
        (["gravel"], "is no tile, but gravel-tile beside it is: name that one"),
        (["missing.png"], "missing.png: no such file"),
        (["hills-tile.exr", "--apart", "0.1"], "--apart: Input should be greater than or equal to 0.5"),
        (["hills-tile.exr", "--apart", "nan"], "--apart: "),
        (["hills-tile.exr", "--fills", "1"], "'1' is not a whole number from 2 to 16"),
        (["hills-tile.exr", "hills-tile.exr"], "two are called hills"),
        (["hills-tile.exr", "--set", "touch.jnd=2"], "touch.jnd: is no setting of a"),
        (["hills-tile.exr", "--plate-mm", "5"], "--plate-mm: 5 mm is less than the 10 mm under a finger"),
    ],
)
def test_bad_input_is_told_in_one_line(
    argv: list[str], told: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["palette", *argv, "-o", str(here)]) == BAD_INPUT
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and told in line
    assert not here.exists()


def test_a_folder_of_something_else_is_refused(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    here.mkdir()
    (here / "letter.txt").write_text("dear")
    assert main(["palette", "hills-tile.exr", "-o", str(here)]) == BAD_INPUT
    assert "holds files that are no palette's; choose another -o" in capsys.readouterr().err
    (here / "palette.toml").write_text("apart = [")
    assert main(["palette", "hills-tile.exr", "-o", str(here)]) == BAD_INPUT
    assert "palette.toml: not TOML" in capsys.readouterr().err


def test_a_person_reads_each_fill_and_the_least_distance() -> None:
    fill = {"label": "hills 1", "level": -1.0, "roughness": [0.0123456], "named_percent": 91.6}
    fills = [fill | {"picture_change_percent_of_white": 0.5}]
    content = {"fills": fills, "fingers": ["this finger"], "least": 2.1, "short": None, "print": ["a.3mf"]}
    table, *lines = palette_fills.PaletteFills(Path("out"), content).lines()
    assert isinstance(table, TextTable) and table.rows == [["hills 1", "-1.00", "0.0123", "0.50", "92"]]
    assert lines[0] == "least apart: 2.10 JND for this finger, by roughness alone"
    short = palette_fills.PaletteFills(Path("out"), content | {"short": "too near"}).lines()
    assert "too near" in [*short] and lines[1] == "out/index.html: 1 fills; to print: a.3mf"
