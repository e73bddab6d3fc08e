"""A height map is read to the mm it stands for, or refused in one line that names the file."""

import io
import os
import struct
import zlib
from pathlib import Path
from typing import Any, Literal

import numpy as np
import OpenEXR
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from relief.ground.errors import InputError
from relief.ground.progress import progress
from relief.heightmap import (
    holds_mm,
    load_field,
    load_height_map,
    load_heights,
    repeats_by_header,
    save_heights_exr,
    save_heights_png,
)
from relief.reading.readers import read_samples
from relief.relief import Relief
from relief.surface import Repeats, axes, repeats_along

SIDE = 32


@pytest.fixture
def ramp() -> NDArray[np.float64]:
    """Heights from 0 to 1 mm, different in every sample."""
    return np.linspace(0.0, 1.0, SIDE * SIDE).reshape(SIDE, SIDE)


def fault(path: Path, relief_mm: float | None = None) -> str:
    with pytest.raises(InputError) as caught:
        load_heights(path, relief_mm=relief_mm)
    line = str(caught.value)
    assert line.startswith(str(path))
    assert "\n" not in line
    return line


def test_white_is_relief_mm_above_black(tmp_path: Path) -> None:
    for dtype, white, suffix in (
        (np.uint8, 255, "png"),
        (np.uint16, 65535, "png"),
        (np.uint16, 65535, "tif"),
    ):
        path = tmp_path / f"half.{suffix}"
        grey = np.zeros((SIDE, SIDE), dtype)
        grey[0] = white
        Image.fromarray(grey).save(path)
        heights = load_heights(path, relief_mm=1.2)
        assert heights.dtype == np.float64
        np.testing.assert_allclose(heights[0], 1.2)
        assert not heights[1:].any()


def test_exr_and_npy_hold_mm(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    save_heights_exr(tmp_path / "ramp.exr", ramp)
    np.save(tmp_path / "ramp.npy", ramp)
    np.testing.assert_allclose(load_heights(tmp_path / "ramp.exr"), ramp, rtol=1e-6)
    np.testing.assert_array_equal(load_heights(tmp_path / "ramp.npy"), ramp)
    np.testing.assert_array_equal(load_heights(tmp_path / "ramp.npy", relief_mm=2.0), ramp)
    Image.fromarray(ramp.astype(np.float32)).save(tmp_path / "ramp.tif")
    np.testing.assert_allclose(load_heights(tmp_path / "ramp.tif", relief_mm=2.0), ramp, rtol=1e-6)
    for name in ("ramp.exr", "ramp.npy", "ramp.tif"):
        assert holds_mm(tmp_path / name)
        scaled = load_heights(tmp_path / name, height_scale=2.0)
        np.testing.assert_allclose(scaled, 2.0 * ramp, rtol=1e-6)


def test_a_scale_of_heights_in_mm_leaves_pictures_as_they_are(
    tmp_path: Path, ramp: NDArray[np.float64]
) -> None:
    for name in ("ramp.png", "ramp.tif"):
        Image.fromarray(np.rint(ramp * 65535).astype(np.uint16)).save(tmp_path / name)
        assert not holds_mm(tmp_path / name)
        heights = load_heights(tmp_path / name, relief_mm=1.0, height_scale=2.0)
        np.testing.assert_allclose(heights, ramp, atol=1e-5)


@pytest.mark.parametrize("suffix", ["exr", "png"])
def test_a_file_remembers_the_lengths_of_its_plate(
    tmp_path: Path, ramp: NDArray[np.float64], suffix: str, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / f"ramp.{suffix}"
    if suffix == "exr":
        save_heights_exr(path, ramp, 12.3, 1.5)
        with OpenEXR.File(str(path), header_only=True) as file:
            attributes = dict(file.parts[0].header)
    else:
        save_heights_png(path, ramp, 1.5, 12.3)
        with Image.open(path) as image:
            attributes = dict(image.info)
    assert float(attributes["retouch.size_mm"]) == pytest.approx(12.3)
    assert float(attributes["retouch.relief_mm"]) == 1.5
    read = load_height_map(path, default_relief_mm=0.1)
    assert read.size_mm == read.side_mm == 12.3
    np.testing.assert_allclose(read.heights, ramp, atol=2e-5)
    assert not caplog.messages
    # What is given goes before the header, and a line says so.
    other = load_height_map(path, size_mm=10.0, relief_mm=3.0)
    assert other.size_mm == 10.0
    np.testing.assert_allclose(other.heights, ramp if suffix == "exr" else 2.0 * ramp, atol=4e-5)
    lines = [f"{path}: size_mm: 10 replaces the 12.3 of the file's header"]
    if suffix == "png":
        lines.insert(0, f"{path}: relief_mm: 3 replaces the 1.5 of the file's header")
    assert caplog.messages == lines


def test_a_file_without_header_takes_the_defaults(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    path = tmp_path / "ramp.png"
    Image.fromarray(np.rint(ramp * 255).astype(np.uint8)).save(path)
    read = load_height_map(path, default_relief_mm=2.0)
    assert (read.heights.max(), read.size_mm, read.side_mm) == (2.0, None, 10.0)


@pytest.mark.parametrize("key", ["size_mm", "relief_mm"])
@pytest.mark.parametrize(
    "value", ["nan", "inf", "-1", "0", "1e300", "1e-300", "9" * 5000, "ten", "\x1b[2J", "1\n2"]
)
def test_a_header_that_lies_is_refused(
    tmp_path: Path, ramp: NDArray[np.float64], key: str, value: str
) -> None:
    text = PngInfo()
    text.add_text(f"retouch.{key}", value)
    path = tmp_path / "ramp.png"
    Image.fromarray(np.rint(ramp * 255).astype(np.uint8)).save(path, pnginfo=text)
    line = fault(path, 1.0)
    assert f"header: {key}: " in line and len(line) < 400 and line.isprintable()
    for attribute in (value, np.array([1.0, 2.0])) if value == "ten" else (value,):
        write_exr(tmp_path / "ramp.exr", {"Y": ramp}, {f"retouch.{key}": attribute})
        assert f"header: {key}: " in fault(tmp_path / "ramp.exr")


def write_tile(path: Path, heights: NDArray[np.float64], repeats: Repeats) -> None:
    if path.suffix == ".exr":
        save_heights_exr(path, heights, repeats=repeats)
    else:
        save_heights_png(path, heights, 1.0, repeats=repeats)


@pytest.mark.parametrize("suffix", [".exr", ".png"])
@pytest.mark.parametrize("repeats", [True, "x", "y", False])
def test_a_file_says_whether_it_is_a_tile(tmp_path: Path, repeats: Repeats, suffix: str) -> None:
    """The header is taken and told where nobody says anything else."""
    path, lines = tmp_path / f"tile{suffix}", list[str]()
    angle = 2.0 * np.pi * np.arange(SIDE) / SIDE
    write_tile(path, 0.5 + 0.2 * np.cos(angle) + 0.2 * np.cos(angle)[:, None], repeats)
    with progress(lambda told: lines.append(told.stage)):
        assert Relief.read(path).repeats == axes(repeats)
        along = "x and y" if repeats is True else repeats
        assert lines == ([f"{path} repeats along {along} (its header)"] if repeats else [])
        for stated in (True, "x", "y", False):
            assert Relief.read(path, repeats=stated).repeats == axes(stated)
        assert len(lines) == bool(repeats)
        assert repeats_by_header(path) == repeats == repeats_along(axes(repeats))


@pytest.mark.parametrize("suffix", [".exr", ".png"])
def test_a_marked_file_whose_sides_do_not_fit_is_a_plate(
    tmp_path: Path, ramp: NDArray[np.float64], suffix: str, caplog: pytest.LogCaptureFixture
) -> None:
    path = tmp_path / f"ramp{suffix}"
    write_tile(path, ramp, True)
    assert Relief.read(path).repeats == (False, False)
    (line,) = caplog.messages
    assert line.startswith(f"{path}: is taken as a plate, though its header says that it repeats: the sides ")
    assert Relief.read(path, repeats=False).repeats == (False, False) and len(caplog.messages) == 1
    with pytest.raises(InputError, match="repeats: the sides do not fit"):
        Relief.read(path, repeats=True)
    assert repeats_by_header(path) is False
    assert repeats_by_header(tmp_path / "absent.exr") is repeats_by_header(tmp_path) is False


@pytest.mark.parametrize("mark", ["", "yx", "True", "xy ", "\x1b[2J", "x\ny", "9" * 5000])
def test_a_header_with_another_mark_of_tiles_is_refused(
    tmp_path: Path, ramp: NDArray[np.float64], mark: str
) -> None:
    text, path = PngInfo(), tmp_path / "ramp.png"
    text.add_text("retouch.repeats", mark)
    Image.fromarray(np.rint(ramp * 255).astype(np.uint8)).save(path, pnginfo=text)
    line = fault(path, 1.0)
    assert "header: repeats: " in line and len(line) < 400 and line.isprintable()
    with pytest.raises(InputError, match="header: repeats: "):
        read_samples(path)
    for attribute in (mark, 1.0, np.array([1.0, 2.0])):
        write_exr(tmp_path / "ramp.exr", {"Y": ramp}, {"retouch.repeats": attribute})
        assert "header: repeats: " in fault(tmp_path / "ramp.exr")


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, -1.0, 1e300])
def test_lengths_that_would_be_refused_are_not_written(
    tmp_path: Path, ramp: NDArray[np.float64], value: float
) -> None:
    with pytest.raises(InputError, match=r"ramp\.exr: size_mm"):
        save_heights_exr(tmp_path / "ramp.exr", ramp, value)
    with pytest.raises(InputError, match=r"ramp\.png: size_mm"):
        save_heights_png(tmp_path / "ramp.png", ramp, 1.0, value)
    with pytest.raises(InputError, match=r"ramp\.png: relief_mm"):
        save_heights_png(tmp_path / "ramp.png", ramp, value)
    assert not list(tmp_path.iterdir())


def test_png_keeps_heights_within_half_a_step(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    path = tmp_path / "ramp.png"
    save_heights_png(path, ramp, 1.5)
    assert np.abs(load_heights(path, relief_mm=1.5) - ramp).max() <= 0.5 * 1.5 / 65535 + 1e-12
    assert [file.name for file in tmp_path.iterdir()] == ["ramp.png"]


def test_what_does_not_fit_a_png_is_not_written(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    with pytest.raises(InputError, match="relief_mm"):
        save_heights_png(tmp_path / "ramp.png", ramp, 0.5)
    assert not list(tmp_path.iterdir())


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    path = tmp_path / "ramp.exr"
    save_heights_exr(path, ramp)
    with pytest.raises(ValueError, match="could not convert"):
        save_heights_exr(path, np.full((SIDE, SIDE), "x"))
    np.testing.assert_allclose(load_heights(path), ramp, rtol=1e-6)
    assert [file.name for file in tmp_path.iterdir()] == ["ramp.exr"]


@pytest.mark.parametrize("channel", ["Y", "Z", "R", "depth"])
def test_an_exr_may_name_its_channel(tmp_path: Path, ramp: NDArray[np.float64], channel: str) -> None:
    path = tmp_path / "ramp.exr"
    write_exr(path, {channel: ramp})
    np.testing.assert_allclose(load_heights(path), ramp, rtol=1e-6)


def test_an_exr_of_unknown_channels_is_refused(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    path = tmp_path / "two.exr"
    write_exr(path, {"u": ramp, "v": ramp})
    assert "channels u, v" in fault(path)


def test_colour_that_is_grey_is_read_and_other_colour_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "colour.png"
    pixels = np.full((SIDE, SIDE, 4), 51, np.uint8)
    Image.fromarray(pixels).save(path)
    np.testing.assert_allclose(load_heights(path, relief_mm=1.0), 0.2)
    pixels[3, 4, 0] = 52
    Image.fromarray(pixels).save(path)
    assert "coloured" in fault(path, 1.0)
    pixels[3, 4] = (51, 51, 51, 50)
    Image.fromarray(pixels).save(path)
    assert "transparency" in fault(path, 1.0)


def test_exr_and_png_follow_one_rule_of_colour(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    path, other = tmp_path / "ramp.exr", ramp.T.copy()
    one = np.ones_like(ramp)
    for channels in (
        {"R": ramp, "G": ramp, "B": ramp},
        {"R": ramp, "G": ramp, "B": ramp, "A": one},
        {"Y": ramp, "R": other, "G": other, "B": ramp},
        {"Z": ramp, "R": other},
        {"Y": ramp, "Z": other, "A": one},
    ):
        write_exr(path, channels)
        np.testing.assert_allclose(load_heights(path), ramp, rtol=1e-6)
    for channels, word in (
        ({"R": ramp, "G": ramp, "B": other}, "coloured"),
        ({"R": ramp, "G": other}, "channels R, G"),
        ({"Y": ramp, "RY": other, "BY": other}, "coloured"),
        ({"Y": ramp, "A": other}, "transparency"),
        ({"R": ramp, "A": np.where(np.eye(SIDE) > 0, np.nan, 1.0)}, "32 of 1024 samples were not measured"),
        ({"R": np.where(np.eye(SIDE) > 0, np.nan, 1.0)}, "32 of 1024 samples were not measured"),
    ):
        write_exr(path, channels)
        assert word in fault(path)


def test_an_exr_of_several_parts_or_sparse_samples_is_refused(
    tmp_path: Path, ramp: NDArray[np.float64]
) -> None:
    path, samples = tmp_path / "ramp.exr", ramp.astype(np.float32)
    parts = [OpenEXR.Part({}, {"Y": samples}, name) for name in ("first", "second")]
    OpenEXR.File(parts).write(str(path))
    assert "several" in fault(path)
    quarter = OpenEXR.Channel("Y", samples[::2, ::2].copy(), 2, 2)
    OpenEXR.File({"dataWindow": ((0, 0), (SIDE - 1, SIDE - 1))}, {"Y": quarter}).write(str(path))
    assert "lacks samples" in fault(path)
    tiled = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    OpenEXR.File(tiled, {"Y": samples}).write(str(path))
    np.testing.assert_allclose(load_heights(path), ramp, rtol=1e-6)
    content = path.read_bytes()
    side = struct.pack("<I", 32)
    path.write_bytes(content.replace(side + side + b"\0", side + struct.pack("<I", 11_075_616) + b"\0"))
    assert "tiles of 32 x 11075616" in fault(path)


@pytest.mark.parametrize(("colour", "channels"), [(2, 3), (4, 2), (6, 4)])
def test_grey_of_16_bits_that_is_stored_as_colour_keeps_all_bits(
    tmp_path: Path, ramp: NDArray[np.float64], colour: int, channels: int
) -> None:
    path, grey = tmp_path / "deep.png", np.rint(ramp * 65535).astype(">u2")
    layers = [grey] * (channels - 1 + channels % 2) + [np.full_like(grey, 65535)] * (1 - channels % 2)
    rows = b"".join(b"\0" + row.tobytes() for row in np.dstack(layers).astype(">u2"))
    path.write_bytes(png_header(SIDE, SIDE, bits=16, colour=colour, rows=rows))
    np.testing.assert_array_equal(load_heights(path, relief_mm=1.0), grey / 65535.0)


def test_a_picture_needs_relief_mm_above_zero(tmp_path: Path) -> None:
    path = tmp_path / "flat.png"
    Image.fromarray(np.zeros((SIDE, SIDE), np.uint8)).save(path)
    assert f"{path}: relief_mm: missing" in fault(path)
    with pytest.raises(InputError) as caught:
        load_heights(path)
    assert caught.value.for_command.startswith(f"{path}: --relief-mm: missing")
    for relief_mm in (0.0, -1.0, float("nan"), float("inf")):
        assert "relief_mm" in fault(path, relief_mm)


@pytest.mark.parametrize("shape", [(1, 1), (SIDE, 15), (15, 15), (4097, 4097), (16, 4097), (SIDE, SIDE, 3)])
def test_only_sides_of_16_to_4096_samples_are_read(tmp_path: Path, shape: tuple[int, ...]) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.zeros(shape, np.uint8))
    fault(path)


def test_a_relief_may_have_any_sides(tmp_path: Path) -> None:
    path, heights = tmp_path / "map.npy", np.linspace(0.0, 1.0, 17 * 40).reshape(17, 40)
    np.save(path, heights)
    np.testing.assert_array_equal(load_heights(path), heights)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.01, 20.01])
def test_one_impossible_height_is_enough_to_refuse(tmp_path: Path, value: float) -> None:
    heights = np.ones((SIDE, SIDE))
    heights[5, 6] = value
    path = tmp_path / "map.npy"
    np.save(path, heights)
    fault(path)


def test_rounding_outside_the_range_is_forgiven(tmp_path: Path) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.where(np.eye(SIDE) > 0, -1e-7, 3 + 1e-7))
    heights = load_heights(path)
    assert heights.min() == 0.0
    assert heights.max() == 3.0


def test_a_bomb_is_refused_by_its_header(tmp_path: Path) -> None:
    path = tmp_path / "bomb.png"
    path.write_bytes(png_header(100_000, 100_000, bits=8, colour=0, rows=b""))
    assert "179 million" in fault(path, 1.0)
    path.write_bytes(png_header(10_000, 10_000, bits=8, colour=0, rows=b""))
    assert "at most 4096" in fault(path, 1.0)


def test_a_pickle_is_not_run(tmp_path: Path) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.full((SIDE, SIDE), None), allow_pickle=True)
    assert "NPY" in fault(path)


NPY_HEADERS = {
    "negative": "{'descr': '<f8', 'fortran_order': False, 'shape': (-32, -32)}",
    "vast": "{'descr': '<f8', 'fortran_order': False, 'shape': (" + "9" * 400 + ", 1)}",
    "overflowing": "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296)}",
    "longer than the file": "{'descr': '<f8', 'fortran_order': False, 'shape': (4096, 4096)}",
    "no tuple": "{'descr': '<f8', 'fortran_order': False, 'shape': 32}",
    "truths": "{'descr': '<f8', 'fortran_order': False, 'shape': (True, True)}",
    "fractions": "{'descr': '<f8', 'fortran_order': False, 'shape': (32.0, 32.0)}",
    "a key too many": "{'descr': '<f8', 'fortran_order': False, 'shape': (32, 32), 'x': 1}",
    "no dictionary": "[1, 2, 3]",
    "a call": "{'descr': __import__('os').mkdir('planted'), 'fortran_order': False, 'shape': (32, 32)}",
    "objects": "{'descr': '|O', 'fortran_order': False, 'shape': (32, 32)}",
    "records": "{'descr': [('a', '<f8'), ('b', '<f8')], 'fortran_order': False, 'shape': (32, 32)}",
    "bytes": "{'descr': '|S8', 'fortran_order': False, 'shape': (32, 32)}",
    "complex": "{'descr': '<c16', 'fortran_order': False, 'shape': (32, 16)}",
    "an unknown kind": "{'descr': 'nonsense', 'fortran_order': False, 'shape': (32, 32)}",
    "a kind of no type": "{'descr': 1.5, 'fortran_order': False, 'shape': (32, 32)}",
    "deep": "(" * 9000,
    "signs": "-" * 9000 + "1",
    "open text": "{'descr': '",
    "two lines": "{'descr': '<f8',\n\x1b[2J\x00}",
    "nothing": "",
}


@pytest.mark.parametrize("header", NPY_HEADERS)
@pytest.mark.parametrize("version", [1, 2, 3, 9])
def test_a_hostile_npy_header_takes_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, header: str, version: int
) -> None:
    monkeypatch.chdir(tmp_path)
    path, text = tmp_path / "map.npy", NPY_HEADERS[header].encode()
    length = len(text).to_bytes(2 if version == 1 else 4, "little")
    path.write_bytes(b"\x93NUMPY" + bytes([version, 0]) + length + text + bytes(8 * SIDE * SIDE))
    line = fault(path)
    assert len(line) < 500 and line.isprintable()
    assert [file.name for file in tmp_path.iterdir()] == ["map.npy"]


@pytest.mark.parametrize("kind", ["<f8", ">f8", "<f4", ">f2", "u1", ">i4", "<u8"])
@pytest.mark.parametrize("fortran", [False, True])
def test_numbers_of_any_kind_and_order_are_read(tmp_path: Path, kind: str, fortran: bool) -> None:
    heights = np.arange(SIDE * SIDE).reshape(SIDE, SIDE) % 4
    np.save(tmp_path / "map.npy", np.asarray(heights, kind, order="F" if fortran else "C"))
    read = load_heights(tmp_path / "map.npy")
    np.testing.assert_array_equal(read, np.minimum(heights, 3))
    assert read.flags.c_contiguous


def test_a_number_beyond_double_precision_is_not_finite(
    tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    np.save(tmp_path / "map.npy", np.full((SIDE, SIDE), np.longdouble("1e4000")))
    assert "nothing was measured" in fault(tmp_path / "map.npy")
    np.save(tmp_path / "map.npy", np.full((SIDE, SIDE), 1e308))
    assert "nothing was measured" in fault(tmp_path / "map.npy")
    assert not recwarn.list


def test_links_that_go_round_are_no_file(tmp_path: Path) -> None:
    for suffix in ("png", "tif", "exr", "npy"):
        path = tmp_path / f"loop.{suffix}"
        path.symlink_to(path)
        assert "no such file" in fault(path, 1.0)
        assert "no such file" in fault(tmp_path / ("n" * 300 + f".{suffix}"), 1.0)


def test_a_file_cut_anywhere_takes_one_line(
    tmp_path: Path, ramp: NDArray[np.float64], capfd: pytest.CaptureFixture[str]
) -> None:
    save_heights_exr(tmp_path / "whole.exr", ramp, 10.0)
    save_heights_png(tmp_path / "whole.png", ramp, 1.0, 10.0)
    np.save(tmp_path / "whole.npy", ramp)
    (tmp_path / "whole.tif").write_bytes(tiff(np.rint(ramp * 65535).astype(int), 16, compression=8))
    for whole in sorted(tmp_path.glob("whole.*")):
        content, path = whole.read_bytes(), tmp_path / f"cut{whole.suffix}"
        for length in range(0, len(content) - 20, max(1, len(content) // 60)):
            path.write_bytes(content[:length])
            fault(path, 1.0)
    assert capfd.readouterr() == ("", "")


def test_what_other_packages_print_of_damage_is_dropped(
    tmp_path: Path, ramp: NDArray[np.float64], capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "ramp.exr"
    save_heights_exr(path, ramp)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x55
    path.write_bytes(content)
    assert "cannot be decoded" in fault(path)
    assert capfd.readouterr() == ("", "")
    os.write(2, b"stderr is as before")
    assert capfd.readouterr().err == "stderr is as before"


@pytest.mark.parametrize("suffix", ["png", "tif", "exr", "npy"])
def test_damaged_files_are_named(tmp_path: Path, ramp: NDArray[np.float64], suffix: str) -> None:
    path = tmp_path / f"map.{suffix}"
    whole = io.BytesIO()
    if suffix == "exr":
        save_heights_exr(path, ramp)
        whole.write(path.read_bytes())
    elif suffix == "npy":
        np.save(whole, ramp)
    else:
        Image.fromarray((ramp * 65535).astype(np.uint16)).save(
            whole, format={"png": "PNG", "tif": "TIFF"}[suffix]
        )
    for content in (b"", b"not a height map", whole.getvalue()[: len(whole.getvalue()) // 2]):
        path.write_bytes(content)
        fault(path, 1.0)


def test_missing_and_foreign_files_are_named(tmp_path: Path) -> None:
    assert "no such file" in fault(tmp_path / "absent.png", 1.0)
    assert "expected one of" in fault(tmp_path / "relief.jpg", 1.0)


def write_exr(
    path: Path, channels: dict[str, NDArray[np.float64]], attributes: dict[str, object] | None = None
) -> None:
    pixels = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **(attributes or {})}
    OpenEXR.File(header, pixels).write(str(path))


def packed(values: NDArray[np.int_], bits: int) -> bytes:
    """Whole numbers (rows, cols) of so many bits, highest bit first; rows end with a byte."""
    return np.packbits(
        (values[..., None] >> np.arange(bits)[::-1] & 1).reshape(len(values), -1), axis=1
    ).tobytes()


def tiff(
    values: NDArray[np.int_],
    bits: int,
    photometric: int | None = 1,
    *,
    order: Literal["<", ">"] = "<",
    compression: int = 1,
    sample_format: int = 1,
    samples: int = 1,
    pages: int = 1,
) -> bytes:
    """A TIFF of grey values (rows, cols), one strip a page."""
    data = packed(values, bits)
    if bits in (16, 32) and order == "<":
        data = values.astype(f"<i{bits // 8}").tobytes()
    data = zlib.compress(data) if compression == 8 else data
    tags: dict[int, int | None] = {256: len(values[0]), 257: len(values), 258: bits, 259: compression}
    tags |= {262: photometric, 273: 8, 277: samples, 278: len(values), 279: len(data), 339: sample_format}
    entries = [(tag, value) for tag, value in tags.items() if value is not None]
    content = {"<": b"II", ">": b"MM"}[order] + struct.pack(f"{order}HI", 42, 8 + len(data)) + data
    for page in range(pages):
        content += struct.pack(f"{order}H", len(entries))
        content += b"".join(struct.pack(f"{order}HHII", tag, 4, 1, value) for tag, value in entries)
        content += struct.pack(f"{order}I", len(content) + 4 if page < pages - 1 else 0)
    return content


@pytest.mark.parametrize("bits", [1, 2, 4, 8, 12, 16])
@pytest.mark.parametrize("photometric", [0, 1])
@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("compression", [1, 8])
def test_a_grey_tiff_is_read_right(
    tmp_path: Path, bits: int, photometric: int, order: Literal["<", ">"], compression: int
) -> None:
    """Bits a sample, whether 0 is white, order of bytes and compression."""
    path, white = tmp_path / "map.tif", 2**bits - 1
    values = np.arange(SIDE * SIDE).reshape(SIDE, SIDE) * white // (SIDE * SIDE - 1)
    path.write_bytes(tiff(values, bits, photometric, order=order, compression=compression))
    grey = values / white if photometric else 1.0 - values / white
    np.testing.assert_allclose(load_heights(path, relief_mm=1.5), 1.5 * grey, atol=1e-12)


def test_a_tiff_that_means_something_else_is_refused(tmp_path: Path) -> None:
    values = np.arange(SIDE * SIDE).reshape(SIDE, SIDE) % 100
    path = tmp_path / "map.tif"
    for content, word in (
        (tiff(values, 8, None), "PhotometricInterpretation"),
        (tiff(values, 16, 3), "TIFF"),
        (tiff(values, 16, sample_format=2), "heights reach 99 mm"),
        (tiff(values, 32, sample_format=6), "SampleFormat"),
        (tiff(values, 8, pages=2), "several"),
        (tiff(values, 8, samples=2), "TIFF"),
    ):
        path.write_bytes(content)
        assert word in fault(path, 1.0)
    Image.fromarray(values.astype(np.uint8)).convert("P").save(path)
    np.testing.assert_allclose(load_heights(path, relief_mm=1.0), values / 255)


@pytest.mark.parametrize(
    "options", [{"tile": (16, 16)}, {"compression": "zlib", "predictor": True}, {"bigtiff": True}]
)
def test_tiles_predictors_and_big_files_are_read(tmp_path: Path, options: dict[str, Any]) -> None:
    values = (np.arange(SIDE * SIDE).reshape(SIDE, SIDE) * 60).astype(np.uint16)
    tifffile.imwrite(tmp_path / "map.tif", values, photometric="minisblack", **options)
    np.testing.assert_allclose(load_heights(tmp_path / "map.tif", relief_mm=1.0), values / 65535)


@pytest.mark.parametrize("bits", [1, 2, 4])
def test_a_png_of_few_bits_reaches_white(tmp_path: Path, bits: int) -> None:
    values = np.arange(SIDE * SIDE).reshape(SIDE, SIDE) % 2**bits
    rows = b"".join(b"\0" + packed(row[None], bits) for row in values)
    path = tmp_path / "map.png"
    path.write_bytes(png_header(SIDE, SIDE, bits=bits, colour=0, rows=rows))
    np.testing.assert_allclose(load_heights(path, relief_mm=1.5), 1.5 * values / (2**bits - 1))


def test_a_png_is_read_without_gamma_and_opaque(tmp_path: Path, ramp: NDArray[np.float64]) -> None:
    path, grey = tmp_path / "map.png", Image.fromarray(np.rint(ramp * 255).astype(np.uint8))
    gamma = PngInfo()
    gamma.add(b"gAMA", struct.pack(">I", 100_000))
    grey.save(path, pnginfo=gamma)
    np.testing.assert_allclose(load_heights(path, relief_mm=1.0), np.asarray(grey) / 255)
    grey.save(path, transparency=0)
    assert "transparency" in fault(path, 1.0)
    grey.convert("P").save(path)
    np.testing.assert_allclose(load_heights(path, relief_mm=1.0), np.asarray(grey) / 255)
    grey.save(path, save_all=True, append_images=[grey.rotate(90)])
    assert "several" in fault(path, 1.0)


def png_header(width: int, height: int, *, bits: int, colour: int, rows: bytes) -> bytes:
    """A PNG of the given header whose compressed data hold ``rows``."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, bits, colour, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b"")
    )


def test_fields_to_cut_textures_from_are_of_any_shape_and_unit(tmp_path: Path) -> None:
    hills = np.linspace(-400.0, 1800.0, 24 * 40).reshape(24, 40)
    np.save(tmp_path / "hills.npy", hills)
    Image.fromarray(hills.astype(np.float32)).save(tmp_path / "hills.tif")
    grey = np.rint(np.linspace(0, 65535, 24 * 40)).astype(np.uint16).reshape(24, 40)
    Image.fromarray(grey).save(tmp_path / "grey.png")
    OpenEXR.File(
        {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage},
        {"Y": hills.astype(np.float32)},
    ).write(str(tmp_path / "hills.exr"))
    np.testing.assert_array_equal(load_field(tmp_path / "hills.npy"), hills)
    for name in ("hills.tif", "hills.exr"):
        np.testing.assert_allclose(load_field(tmp_path / name), hills, rtol=1e-6)
    np.testing.assert_allclose(load_field(tmp_path / "grey.png"), grey / 65535)


def test_fields_too_large_or_of_too_many_sides_are_refused(tmp_path: Path) -> None:
    for shape in ((2, 8193), (16, 16, 3)):
        np.save(tmp_path / "a.npy", np.zeros(shape, np.uint8))
        with pytest.raises(InputError, match=r"a\.npy: shape"):
            load_field(tmp_path / "a.npy")
    with pytest.raises(InputError, match="no such file"):
        load_field(tmp_path / "b.png")
