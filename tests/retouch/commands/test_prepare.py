"""`retouch prepare` makes what the other verbs take, and their refusals name a command that works."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from relief.heightmap import load_height_map, save_heights_png
from retouch.commands.main import main

SIDE = 40


@pytest.fixture(autouse=True)
def pictures(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty working directory, pictures that no other verb takes."""
    monkeypatch.chdir(tmp_path)
    y, x = np.mgrid[:SIDE, : SIDE + 8] / SIDE
    values = (120 + 60 * np.sin(9 * x) * np.cos(8 * y)).astype(np.uint8)
    colour = np.stack([values, values // 2, 255 - values], axis=-1)
    square = values[:, :SIDE]
    Image.fromarray(colour[:, :SIDE]).save("my stone.jpg")
    Image.fromarray(colour[:, :SIDE]).save("colour.png")
    Image.fromarray(colour[:, :SIDE]).save("colour.tif")
    Image.fromarray(colour[:, :SIDE]).quantize(64).save("palette.png")
    Image.fromarray(values).save("wide.png")
    Image.fromarray(np.dstack([colour, values])).save("alpha.png")
    Image.fromarray(square).save("several.png", save_all=True, append_images=[Image.fromarray(255 - square)])
    np.save("colour.npy", colour)


def printed(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    assert main(argv) == 0
    return capsys.readouterr().out


@pytest.mark.slow
def test_the_numbers_of_the_screen_and_of_json(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["prepare", "my stone.jpg", "-o", "stone.png", "--relief-mm", "0.4", "--samples", "32"]
    lines = printed(capsys, *command)
    for word in ("JPEG in colour", "luminance", "slopes", "roughness 0.0", "stone-preview.png"):
        assert word in lines
    entry = json.loads(printed(capsys, *command, "--json"))
    assert (entry["heights"], entry["preview"]) == ("stone.png", "stone-preview.png")
    (evaluated,) = json.loads(printed(capsys, "evaluate", "stone.png", "--json"))
    for key in ("roughness", "contact_area_mm2", "contact_fraction"):
        assert evaluated[key] == pytest.approx(entry[key], rel=1e-3)
    with Image.open("stone-preview.png") as sheet:
        assert sheet.mode == "RGB" and sheet.width > 1000
        assert len(np.unique(np.asarray(sheet).reshape(-1, 3), axis=0)) > 100


@pytest.mark.slow
def test_a_tile_and_an_exr(capsys: pytest.CaptureFixture[str]) -> None:
    argv = ["prepare", "wide.png", "-o", "tile.exr", "--relief-mm", "0.4", "--tile", "--samples", "32"]
    lines = printed(capsys, *argv, "--crop", "2,0,44,40", "--invert", "--levels", "1%,99%")
    assert "seam error" in lines and "dark is high" in lines
    assert load_height_map("tile.exr").heights.shape == (32, 32)
    assert "places of the finger, roughness 0.0" in lines
    assert "says that it is a tile; --no-repeats takes it as a plate" in lines
    whole = json.loads(printed(capsys, "evaluate", "tile.exr", "--json"))
    assert whole == json.loads(printed(capsys, "evaluate", "tile.exr", "--repeats", "--json"))
    assert "places" not in json.loads(printed(capsys, "evaluate", "tile.exr", "--no-repeats", "--json"))[0]
    plated = json.loads(printed(capsys, "prepare", "tile.exr", "-o", "a.exr", "--plate-mm", "20", "--json"))
    assert plated["size_mm"] == 20.0 and plated["plate"] == {"tile_mm": 10.0, "tile_samples": 32}
    assert plated["places"]["count"] == 16
    assert plated["places"]["roughness_min"] < plated["roughness"] < plated["places"]["roughness_max"]
    plain = printed(capsys, "prepare", "wide.png", "-o", "plain.png")
    assert "unknown without --relief-mm" in plain and "repeats" not in plain


@pytest.mark.slow
def test_what_helps_a_smooth_relief_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Of hills a higher relief, of features too fine for the finger larger ones."""
    row, col = np.indices((32, 32))
    hills = (127 + 120 * np.sin(0.5 * row) * np.sin(0.5 * col)).astype(np.uint8)
    Image.fromarray((200 * ((row + col) % 2)).astype(np.uint8)).save("fine.png")
    weave = (127 + 120 * np.sin(1.3 * row) * np.sin(1.3 * col)).astype(np.uint8)
    Image.fromarray(weave).save("weave.png")
    Image.fromarray(hills).save("hills.png")
    told = "smoother than natural surfaces (0.03 to 0.12); "
    argv = ["prepare", "fine.png", "-o", "a.exr", "--relief-mm", "0.6", "--size-mm", "10"]
    lines = " ".join(printed(capsys, *argv).split())
    assert f"{told}features are too fine for the finger (roughness 0.0" in lines
    assert "at 2 mm): --crop or --centre a smaller part, or take a larger --size-mm" in lines
    # A part of a file whose header tells its size has the same features.
    lines = " ".join(printed(capsys, "prepare", "a.exr", "-o", "b.exr").split())
    assert "at 2 mm): take a larger --size-mm" in lines
    lines = " ".join(printed(capsys, "prepare", "hills.png", "-o", "a.exr", "--relief-mm", "0.05").split())
    assert f"{told}a higher --relief-mm helps (roughness " in lines
    # A higher relief would be rough enough, of walls.
    lines = " ".join(printed(capsys, "prepare", "weave.png", "-o", "w.exr", "--relief-mm", "0.5").split())
    assert f"{told}features are too fine for the finger (roughness 0.0" in lines
    assert "at 2 mm, where half of the slopes are above " in lines
    assert "a smaller part, or take a larger --size-mm, so that bumps are 1 to 3 mm apart" in lines


@pytest.mark.parametrize(
    "name",
    [
        *("my stone.jpg", "colour.png", "colour.tif", "palette.png"),
        *("alpha.png", "several.png", "colour.npy"),
        pytest.param("huge.png", marks=pytest.mark.slow),
    ],
)
def test_a_refusal_names_the_command_that_mends_it(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    if name == "huge.png":
        Image.linear_gradient("L").resize((128 * SIDE, 128 * SIDE)).save(name)
    relief = [] if name.endswith("npy") else ["--relief-mm", "0.4"]
    for verb in (["evaluate"], ["optimize", "--jnd", "1"], ["export", "-o", "a.stl"]):
        assert main([verb[0], name, *verb[1:], *relief]) == 2
        line = capsys.readouterr().err
        assert line.startswith("retouch: ") and f"{name}: " in line and line.count("\n") == 1
        program, *command = shlex.split(line[line.index("retouch prepare") :])
        assert program == "retouch"
    assert main([*command, *([] if relief else ["--relief-mm", "0.4"])]) == 0
    heights = load_height_map(command[command.index("-o") + 1]).heights
    assert heights.max() == pytest.approx(0.4, abs=0.005) and heights.min() == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize(
    ("argv", "word"),
    [
        ("absent.jpg -o a.png", "no such file"),
        ("wide.png -o a.jpg", "written as .png or .exr"),
        ("wide.png -o a.exr", "a.exr: --relief-mm: missing"),
        ("wide.png -o folder/a.png", "there is no folder"),
        ("wide.png -o wide.png", "is the picture"),
        ("wide.png -o .", "is a folder"),
        ("wide.png -o a.png --crop 1,2,3", "--crop"),
        ("wide.png -o a.png --tile sewn", "choose from 'auto', 'blend', 'cut'"),
        ("wide.png -o a.png --samples 9", "--samples"),
        ("wide.png -o a.png --levels 9", "levels"),
    ],
)
def test_nothing_is_written_after_a_refusal(argv: str, word: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(Path().iterdir())
    assert main(["prepare", *argv.split()]) == 2
    line = capsys.readouterr().err
    assert word in line and line.count("\n") == 1
    assert sorted(Path().iterdir()) == before


def test_a_relief_that_cannot_be_pressed_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    """A plate smaller than the places that the finger compares."""
    argv = ["prepare", "wide.png", "-o", "a.exr", "--relief-mm", "0.1", "--size-mm", "1.5"]
    lines = " ".join(printed(capsys, *argv).split())
    assert "not pressed: " in lines and "a patch of 1.5 mm is smaller than" in lines
    assert load_height_map("a.exr").size_mm == 1.5 and Path("a-preview.png").exists()
    assert "roughness" not in json.loads(printed(capsys, *argv, "--json"))


def test_a_tile_along_one_axis_keeps_its_mark(capsys: pytest.CaptureFixture[str]) -> None:
    waves = np.sin(np.pi * np.arange(32) / 8) * np.linspace(0.5, 1.0, 32)[:, None]
    save_heights_png("a.png", 0.5 + 0.4 * waves, 1.0, 1.5, repeats="x")
    lines = " ".join(printed(capsys, "prepare", "a.png", "-o", "b.png").split())
    assert "b.png says that it repeats along x; --no-repeats takes it as a plate" in lines
    assert load_height_map("b.png").repeats == "x"
