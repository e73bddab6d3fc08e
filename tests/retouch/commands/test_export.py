"""`retouch export`: plates, repeated tiles and displacement, read back by other programs."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from optimize.settings.run_file import dump_resolved, run_from_scene
from relief.ground.formats import FORMATS
from relief.heightmap import load_height_map, save_heights_exr
from relief.printed import printed
from relief.printers import find_printer
from relief.seam import misfit
from relief.solids.wrapping.texture_tiles import Tile
from retouch.commands.main import BAD_INPUT, main


def hills(rows: int = 32, cols: int = 32) -> np.ndarray:
    """Samples of a tile, hills two and three to a side, from 0.05 to 0.85 mm."""
    y, x = np.meshgrid(
        2.0 * np.pi * np.arange(rows) / rows, 2.0 * np.pi * np.arange(cols) / cols, indexing="ij"
    )
    waves = np.sin(2.0 * x + y) + 0.6 * np.cos(3.0 * y - x)
    return np.asarray(0.05 + 0.8 * (waves - waves.min()) / np.ptp(waves))


@pytest.fixture(autouse=True)
def _reliefs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    save_heights_exr("tile.exr", hills(), 10.0)
    save_heights_exr("slope.exr", np.linspace(0.0, 1.0, 32)[None, :] * np.ones((32, 1)), 10.0)


def told(capsys: pytest.CaptureFixture[str], *argv: str) -> Any:
    """What the command prints as JSON."""
    assert main(["export", *argv, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def refused(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    """The line by which the command refuses; a warning may precede it."""
    assert main(["export", *argv]) == BAD_INPUT
    (line,) = [line for line in capsys.readouterr().err.splitlines() if " replaces the " not in line]
    return line


def by_trimesh(path: str) -> trimesh.Trimesh:
    """The one body of a file in mm, z up, as a library of meshes reads it."""
    mesh = trimesh.load_scene(path).to_mesh()
    if path.endswith(".glb"):
        x, y, z = 1000.0 * mesh.vertices.T
        mesh.vertices = np.column_stack([x, -z, y])
    mesh.merge_vertices(merge_tex=True, merge_norm=True)
    return mesh


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_plate_is_closed_and_has_its_size_and_heights(
    suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    size = ("--size-mm", "20", "--base-mm", "1.5")
    assert main(["export", "tile.exr", *size, "-o", f"plate{suffix}"]) == 0
    assert capsys.readouterr().out.startswith(f"plate{suffix}: 20 x 20 x 2.35 mm, ")
    body = by_trimesh(f"plate{suffix}")
    assert body.is_watertight and body.is_winding_consistent and body.body_count == 1
    np.testing.assert_allclose(body.extents, [20.0, 20.0, 1.5 + hills().max()], atol=1e-3)
    # The samples lie at the centres of 32 x 32 squares of 0.625 mm.
    inside = np.abs(body.vertices[:, :2]).max(axis=1) < 9.9
    column, row = np.rint((body.vertices[inside, :2] * (1, -1) + 10.0) / 0.625 - 0.5).astype(int).T
    above = body.vertices[inside, 2] > -1.0
    assert above.sum() == 32 * 32
    np.testing.assert_allclose(body.vertices[inside, 2][above], hills()[row, column][above], atol=1e-3)


@pytest.mark.parametrize(
    ("times", "sides"), [("3x3", (30.0, 30.0)), ("3x2", (30.0, 20.0)), ("1x2", (10.0, 20.0))]
)
def test_tiles_make_one_watertight_body(
    times: str, sides: tuple[float, float], capsys: pytest.CaptureFixture[str]
) -> None:
    told_size = told(capsys, "tile.exr", "--repeat", times, "-o", "tiles.stl")["size_mm"]
    body = by_trimesh("tiles.stl")
    assert told_size == sides[0]
    assert body.is_volume and body.body_count == 1 and body.euler_number == 2
    np.testing.assert_allclose(body.extents[:2], sides, atol=1e-4)
    # Each tile adds the same volume, but for the flat rims, half a sample wide, where there is no neighbour.
    mean = body.volume / (sides[0] * sides[1]) - 2.0
    assert mean == pytest.approx(hills().mean(), rel=0.01)


def test_the_size_of_tiles_is_that_of_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        told(capsys, "tile.exr", "--repeat", "2x2", "--size-mm", "12", "-o", "tiles.3mf")["size_mm"] == 24.0
    )
    assert by_trimesh("tiles.3mf").extents[:2] == pytest.approx([24.0, 24.0], abs=1e-3)


def test_displacement_has_its_scale_and_gives_back_heights(capsys: pytest.CaptureFixture[str]) -> None:
    """Black is height 0, not the lowest point, so that a plate stays as thick as it was."""
    found = told(capsys, "tile.exr", "--size-mm", "12", "-o", "tile.png")
    assert found["strength_mm"] == pytest.approx(0.85) and found["midlevel"] == 0.0
    assert (found["size_mm"], found["height_mm"]) == (12.0, 12.0)
    with Image.open("tile.png") as image:
        assert image.mode in ("I;16", "I") and image.info["retouch.size_mm"] == "12.0"
        levels = np.asarray(image, dtype=np.float64)
    half_a_level = 0.51 * found["strength_mm"] / 65535
    np.testing.assert_allclose(found["strength_mm"] * levels / 65535, hills(), atol=half_a_level)
    read = load_height_map("tile.png")
    assert read.size_mm == 12.0
    np.testing.assert_allclose(read.heights, hills(), atol=half_a_level)


def test_displacement_tells_what_to_type(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "tile.exr", "--repeat", "2x1", "-o", "tile.png"]) == 0
    line = capsys.readouterr().out
    assert line.startswith("tile.png: 20 x 10 mm") and "strength 0.85 mm, midlevel 0" in line


def test_a_tile_is_a_finer_picture_above_its_lowest_point_with_a_page(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """512 pixels, between the samples by the splines of `retouch wrap`, which repeat."""
    found = told(capsys, "tile.exr", "--tile", "-o", "seamless.png")
    assert (found["page"], found["midlevel"], found["bits"]) == ("seamless.html", 0.0, 16)
    read = load_height_map("seamless.png")
    assert read.heights.shape == (512, 512) and read.repeats is True and read.size_mm == 10.0
    depth = found["strength_mm"]
    assert depth == pytest.approx(np.ptp(hills()), rel=1e-3) and read.heights.min() == 0.0
    at = np.stack(np.meshgrid(*2 * [(np.arange(512) + 0.5) * 10.0 / 512]), axis=-1).reshape(-1, 2)
    exact = Tile(hills(), 10.0 / 32).at(at * (1, -1)).reshape(512, 512) - hills().min()
    exact -= exact.min()
    np.testing.assert_allclose(read.heights, exact, atol=1.01 * depth / 65535)
    assert misfit(read.heights) is None
    page = Path("seamless.html").read_text()
    for typed in (
        "Size U and V 10 mm; Texture height 0.7999 mm",
        "Resolution 0.31 mm",
        "Strength 0.7999, Midlevel 0",
        "an empty of scale 5 x 5",
    ):
        assert typed in page


def test_flat_displacement_is_black(capsys: pytest.CaptureFixture[str]) -> None:
    save_heights_exr("flat.exr", np.zeros((16, 16)), 10.0)
    told(capsys, "flat.exr", "-o", "flat.png")
    assert not load_height_map("flat.png").heights.any()


def test_a_run_directory_stands_for_its_result(capsys: pytest.CaptureFixture[str]) -> None:
    Path("run").mkdir()
    assert "no run has left its result" in refused(capsys, "run", "-o", "plate.stl")
    save_heights_exr("run/heights.exr", hills(), 15.0)
    assert told(capsys, "run", "-o", "plate.stl")["size_mm"] == 15.0


def test_a_print_has_flat_pixels_of_whole_layers(capsys: pytest.CaptureFixture[str]) -> None:
    """Of filament 0.2 mm thick in strands of 0.4 mm, 50 of them across both tiles."""
    argv = ("tile.exr", "--repeat", "2x1", "--printer", "filament")
    found = told(capsys, *argv, "-o", "print.stl")
    assert found["printer"] == "filament" and found["size_mm"] == 20.0
    body = by_trimesh("print.stl")
    assert body.is_volume and body.body_count == 1
    tops = body.vertices[body.vertices[:, 2] > -1.0]
    np.testing.assert_allclose(tops[:, 2], np.rint(tops[:, 2] / 0.2) * 0.2, atol=1.1e-3)
    told(capsys, *argv, "-o", "print.png")
    model = printed(np.tile(hills(), (1, 2)), 10.0 / 32, find_printer("filament"))
    np.testing.assert_allclose(load_height_map("print.png").heights, model, atol=1e-5)


def test_the_result_of_a_run_with_a_printer_is_a_print(capsys: pytest.CaptureFixture[str]) -> None:
    run = run_from_scene("studio", "tile.exr", ["touch.jnd=1", "print.printer=filament"])
    Path("run").mkdir()
    Path("run/run.toml").write_text(dump_resolved(run))
    save_heights_exr("run/heights.exr", printed(hills(), 10.0 / 32, find_printer("filament")), 10.0)
    assert told(capsys, "run", "-o", "plate.stl")["printer"] == "filament"
    tops = by_trimesh("plate.stl").vertices[:, 2]
    np.testing.assert_allclose(tops, np.rint(tops / 0.2) * 0.2, atol=1.1e-3)
    assert "has a printer already" in refused(capsys, "run", "--printer", "mask-50", "-o", "again.stl")


@pytest.mark.parametrize(
    ("argv", "said"),
    [
        (("slope.exr", "--repeat", "2x1", "-o", "a.stl"), "slope.exr: repeats: the sides do not fit along x"),
        (("tile.exr", "--repeat", "200x1", "-o", "a.stl"), "6400 x 32 samples; at most 4096 a side"),
        (("tile.exr", "--size-mm", "900", "--repeat", "2x1", "-o", "a.stl"), "--size-mm: 1800 is outside"),
        (("tile.exr", "--size-mm", "900", "--repeat", "2x1", "-o", "a.png"), "--size-mm: 1800"),
        (
            ("tile.exr", "--base-mm", "1", "-o", "a.png"),
            "--base-mm: is for plates; a.png holds heights alone",
        ),
        (("slope.exr", "--tile", "-o", "a.png"), "slope.exr: repeats: the sides do not fit along x"),
        (("tile.exr", "--tile", "-o", "a.stl"), "--tile: writes .png; a.stl is none"),
        (("--coupon", "--tile", "-o", "a.stl"), "--tile: is for textures"),
        (("tile.exr", "-o", "a.step"), "'.step' is not one of"),
        (("tile.exr", "-o", "tile.exr"), "tile.exr: -o: is the texture itself"),
    ],
)
def test_what_cannot_be_written_is_refused(
    argv: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert said in refused(capsys, *argv)
    assert sorted(path.name for path in Path().iterdir()) == ["slope.exr", "tile.exr"]


@pytest.mark.parametrize("text", ["3", "0x2", "3x", "x3", "3x-1", "1000x1", "3 x 3", "257x1"])
def test_repeats_that_are_no_two_numbers_are_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "as in 3x2" in refused(capsys, "tile.exr", "--repeat", text, "-o", "a.stl")


def test_a_slope_repeats_along_the_axis_where_it_fits(capsys: pytest.CaptureFixture[str]) -> None:
    assert told(capsys, "slope.exr", "--repeat", "1x2", "-o", "a.stl")["size_mm"] == 10.0


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_size_of_a_large_file_is_told_before(
    suffix: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("retouch.verbs.exporting.MANY_TRIANGLES", 1000)
    assert main(["export", "gravel-tile", "-o", f"plate{suffix}"]) == 0
    line = capsys.readouterr().err
    size = Path(f"plate{suffix}").stat().st_size / 1e6
    (told_mb,) = re.findall(r"about ([0-9]+) MB", line)
    assert float(told_mb) == pytest.approx(size, rel=0.15, abs=0.5)
