"""Pictures of any kind are opened upright, with their true grey, or refused in one line."""

import struct
import zlib
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.preparing.resampling import grey_values
from relief.reading.readers import read_samples
from relief.reading.samples import Samples

WIDE, HIGH = 24, 20


@pytest.fixture
def colours() -> NDArray[np.uint8]:
    return np.random.default_rng(3).integers(0, 256, (HIGH, WIDE, 3), dtype=np.uint8)


def grey(picture: Samples, name: str = "luminance") -> NDArray[np.float32] | Array:
    return grey_values(picture, (0, 0, picture.width, picture.height), name)


def fault(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        grey(read_samples(path))
    line = str(caught.value)
    assert "\n" not in line and len(line) < 500
    return line


@pytest.mark.parametrize("suffix", ["png", "tif", "bmp", "ppm", "webp"])
def test_colour_becomes_grey_by_its_weights(tmp_path: Path, colours: NDArray[np.uint8], suffix: str) -> None:
    path = tmp_path / f"stone.{suffix}"
    if suffix == "webp":
        Image.fromarray(colours).save(path, lossless=True)
    else:
        Image.fromarray(colours).save(path)
    picture = read_samples(path)
    assert (picture.width, picture.height, picture.bits, picture.coloured) == (WIDE, HIGH, 8, True)
    unit = colours / 255.0
    np.testing.assert_allclose(grey(picture), unit @ [0.2126, 0.7152, 0.0722], atol=1e-6)
    np.testing.assert_allclose(grey(picture, "mean"), unit.mean(axis=-1), atol=1e-6)
    np.testing.assert_allclose(grey(picture, "blue"), unit[..., 2], atol=1e-6)
    with pytest.raises(InputError, match="no channel A"):
        grey(picture, "alpha")


@pytest.mark.parametrize("mode", ["L", "P", "RGB", "LA", "CMYK", "1"])
@pytest.mark.parametrize("suffix", ["png", "tif", "gif"])
def test_grey_in_any_mode_is_grey(tmp_path: Path, mode: str, suffix: str) -> None:
    values = np.arange(HIGH * WIDE, dtype=np.uint8).reshape(HIGH, WIDE) % 250
    values = np.where(values > 120, 255, 0).astype(np.uint8) if mode == "1" else values
    image = Image.fromarray(values).convert(mode)
    if (mode, suffix) in {("CMYK", "png"), ("CMYK", "gif"), ("LA", "gif")}:
        pytest.skip("there is no such file")
    image.save(tmp_path / f"a.{suffix}")
    picture = read_samples(tmp_path / f"a.{suffix}")
    assert not picture.coloured
    np.testing.assert_allclose(grey(picture), values / 255.0, atol=1e-6)


def test_16_bits_are_kept_whichever_end_is_white(tmp_path: Path) -> None:
    values = np.arange(HIGH * WIDE, dtype=np.uint16).reshape(HIGH, WIDE) * 130
    Image.fromarray(values).save(tmp_path / "a.png")
    tifffile.imwrite(tmp_path / "a.tif", values, photometric="minisblack")
    tifffile.imwrite(tmp_path / "b.tif", values, photometric="miniswhite")
    for name in ("a.png", "a.tif"):
        picture = read_samples(tmp_path / name)
        assert picture.bits == 16
        np.testing.assert_allclose(grey(picture), values / 65535.0, atol=1e-6)
    np.testing.assert_allclose(grey(read_samples(tmp_path / "b.tif")), 1.0 - values / 65535.0, atol=1e-6)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_photograph_stands_upright(tmp_path: Path, orientation: int) -> None:
    """The eight orientations of EXIF, each undone by the transpositions of its definition."""
    upright = np.arange(HIGH * WIDE, dtype=np.uint8).reshape(HIGH, WIDE) % 200
    stored = {
        1: upright,
        2: upright[:, ::-1],
        3: upright[::-1, ::-1],
        4: upright[::-1],
        5: upright.T,
        6: upright.T[::-1],
        7: upright.T[::-1, ::-1],
        8: upright.T[:, ::-1],
    }[orientation]
    exif = Image.Exif()
    exif[274] = orientation
    Image.fromarray(np.ascontiguousarray(stored)).save(tmp_path / "a.png", exif=exif)
    picture = read_samples(tmp_path / "a.png")
    np.testing.assert_allclose(grey(picture), upright / 255.0, atol=1e-6)
    assert ("turned upright by its EXIF orientation" in picture.notes) == (orientation != 1)


def test_transparent_parts_count_as_white(tmp_path: Path, colours: NDArray[np.uint8]) -> None:
    alpha = np.linspace(0, 255, HIGH * WIDE).astype(np.uint8).reshape(HIGH, WIDE)
    Image.fromarray(np.dstack([colours, alpha])).save(tmp_path / "a.png")
    picture = read_samples(tmp_path / "a.png")
    share = alpha / 255.0
    expected = share * (colours / 255.0 @ [0.2126, 0.7152, 0.0722]) + 1.0 - share
    np.testing.assert_allclose(grey(picture), expected, atol=1e-6)
    np.testing.assert_allclose(grey(picture, "alpha"), share, atol=1e-6)
    opaque = np.full_like(alpha, 255)
    Image.fromarray(np.dstack([colours, opaque])).save(tmp_path / "b.png")
    assert "A" not in read_samples(tmp_path / "b.png").channels


def test_files_of_numbers_keep_their_unit(tmp_path: Path) -> None:
    hills = np.linspace(-400.0, 1800.0, HIGH * WIDE).reshape(HIGH, WIDE)
    np.save(tmp_path / "a.npy", hills)
    Image.fromarray(hills.astype(np.float32)).save(tmp_path / "a.tif")
    OpenEXR.File(
        {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage},
        {name: (factor * hills).astype(np.float32) for name, factor in (("R", 1), ("G", 2), ("B", 3))},
    ).write(str(tmp_path / "colour.exr"))
    for name in ("a.npy", "a.tif"):
        picture = read_samples(tmp_path / name)
        assert picture.bits is None
        np.testing.assert_allclose(grey(picture), hills, rtol=1e-6)
    np.testing.assert_allclose(grey(read_samples(tmp_path / "colour.exr"), "mean"), 2 * hills, rtol=1e-6)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_numbers_that_are_not_finite_were_not_measured(tmp_path: Path, value: float) -> None:
    values = np.ones((HIGH, WIDE))
    values[2, 3] = value
    np.save(tmp_path / "a.npy", values)
    Image.fromarray(values.astype(np.float32)).save(tmp_path / "a.tif")
    for name in ("a.npy", "a.tif"):
        assert [*zip(*np.nonzero(np.isnan(grey(read_samples(tmp_path / name)))), strict=True)] == [(2, 3)]


def test_a_file_cut_anywhere_takes_one_line(
    tmp_path: Path, colours: NDArray[np.uint8], capfd: pytest.CaptureFixture[str]
) -> None:
    for suffix in ("png", "jpg", "tif", "webp", "gif", "bmp"):
        whole = tmp_path / f"whole.{suffix}"
        Image.fromarray(colours).save(whole)
        content, path = whole.read_bytes(), tmp_path / f"cut.{suffix}"
        for length in range(0, len(content) // 2, max(1, len(content) // 20)):
            path.write_bytes(content[:length])
            assert str(path) in fault(path)
    assert capfd.readouterr() == ("", "")


def test_bombs_and_foreign_files_take_one_line(tmp_path: Path) -> None:
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    path = tmp_path / "bomb.png"
    for side, word in ((100_000, "million"), (33_000, "million"), (40_000, "million")):
        header = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0))
        path.write_bytes(b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"")))
        assert word in fault(path)
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 60_000, 16, 8, 0, 0, 0, 0))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"")))
    assert "32768 pixels a side" in fault(path)
    path.write_text("no picture")
    assert "save the picture as one of these" in fault(path)
    assert "no such file" in fault(tmp_path / "absent.jpg")
    assert "no such file" in fault(tmp_path)
    for shape in ((0, 5), (4,), (4, 4, 2), (3, 3, 3, 3)):
        np.save(tmp_path / "a.npy", np.zeros(shape))
        assert "a.npy" in fault(tmp_path / "a.npy")


def test_a_large_picture_is_read_without_a_warning(
    tmp_path: Path, colours: NDArray[np.uint8], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Pillow warns of a bomb at half the pixels that it refuses."""
    Image.fromarray(colours).save(tmp_path / "a.png")
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", HIGH * WIDE * 2 // 3)
    grey(read_samples(tmp_path / "a.png"))
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", HIGH * WIDE // 3)
    assert "million pixels" in fault(tmp_path / "a.png")


def test_the_first_of_several_pictures_counts(tmp_path: Path, colours: NDArray[np.uint8]) -> None:
    first, second = Image.fromarray(colours[..., 0]), Image.fromarray(colours[..., 1])
    for suffix in ("gif", "tif", "png"):
        first.save(tmp_path / f"a.{suffix}", save_all=True, append_images=[second])
        picture = read_samples(tmp_path / f"a.{suffix}")
        assert any("the first of" in note for note in picture.notes)
        np.testing.assert_allclose(grey(picture), colours[..., 0] / 255.0, atol=1e-6)
