"""A height map is read to the mm it stands for, or refused in one line that names the file."""

import io
import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray
from PIL import Image

from relief.errors import InputError
from relief.heightmap import load_field, load_heights, save_heights_exr, save_heights_png

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
    np.testing.assert_allclose(load_heights(tmp_path / "ramp.npy", relief_mm=2.0), 2 * ramp)


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


def test_16_bit_colour_is_refused_rather_than_rounded(tmp_path: Path) -> None:
    path = tmp_path / "deep.png"
    path.write_bytes(png_header(SIDE, SIDE, bits=16, colour=2, rows=bytes(SIDE * (1 + SIDE * 6))))
    assert "grey" in fault(path, 1.0)


def test_a_picture_needs_relief_mm_above_zero(tmp_path: Path) -> None:
    path = tmp_path / "flat.png"
    Image.fromarray(np.zeros((SIDE, SIDE), np.uint8)).save(path)
    assert "relief_mm: missing" in fault(path)
    for relief_mm in (0.0, -1.0, float("nan"), float("inf")):
        assert "relief_mm" in fault(path, relief_mm)


@pytest.mark.parametrize("shape", [(1, 1), (SIDE, SIDE + 1), (15, 15), (4097, 4097), (SIDE, SIDE, 3)])
def test_only_squares_of_16_to_4096_samples_are_read(tmp_path: Path, shape: tuple[int, ...]) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.zeros(shape, np.uint8))
    fault(path)


@pytest.mark.parametrize("value", [np.nan, np.inf, -0.01, 3.01])
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
    assert "at most 4096" in fault(path, 1.0)
    path.write_bytes(png_header(10_000, 10_000, bits=8, colour=0, rows=b""))
    assert "at most 4096" in fault(path, 1.0)


def test_a_pickle_is_not_run(tmp_path: Path) -> None:
    path = tmp_path / "map.npy"
    np.save(path, np.full((SIDE, SIDE), None), allow_pickle=True)
    assert "NPY" in fault(path)


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


def write_exr(path: Path, channels: dict[str, NDArray[np.float64]]) -> None:
    pixels = {name: np.ascontiguousarray(values, np.float32) for name, values in channels.items()}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, pixels).write(
        str(path)
    )


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
