"""Pictures and height maps as their owners have them: one test for each kind that was once read wrong."""

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
from relief.heightmap import load_height_map
from relief.preparing.picture_preparation import prepare
from relief.reading.readers import read_samples
from relief.reading.terraces import terraces


@pytest.fixture(scope="module")
def bumps() -> Array:
    """(128, 128) round bumps from 0 to 1, which go on as themselves across the border."""
    return _bumps(128)


def _bumps(side: int) -> Array:
    y, x = np.mgrid[0:side, 0:side] / side
    heights = np.zeros((side, side))
    for column, row, size, height in np.random.default_rng(3).random((60, 4)):
        dx, dy = (x - column + 0.5) % 1 - 0.5, (y - row + 0.5) % 1 - 0.5
        heights += height * np.exp(-(dx**2 + dy**2) / (2 * (0.02 + 0.05 * size) ** 2))
    return np.asarray((heights - heights.min()) / np.ptp(heights))


def fault(path: Path, relief_mm: float | None = None) -> str:
    """The line by which both readers refuse a file."""
    lines = []
    for read in (load_height_map, prepare):
        with pytest.raises(InputError) as caught:
            read(path, relief_mm=relief_mm)
        lines.append(caught.value.for_command)
    assert all("\n" not in line and line.startswith(str(path)) for line in lines)
    return " | ".join(lines)


@pytest.mark.parametrize("orientation", [6, 8])
@pytest.mark.parametrize("compression", [None, "tiff_lzw"])
def test_a1_a_tiff_stands_upright(tmp_path: Path, orientation: int, compression: str | None) -> None:
    stored = np.full((200, 300), 60 * 257, np.uint16)
    stored[:50, :80] = 220 * 257
    file = tmp_path / "a.tif"
    Image.fromarray(stored).save(file, tiffinfo={274: orientation}, compression=compression)
    upright = np.rot90(stored, -1 if orientation == 6 else 1)
    np.testing.assert_array_equal(read_samples(file).channels["Y"], upright)
    np.testing.assert_allclose(load_height_map(file, relief_mm=1.0).heights, upright / 65535.0)


def test_a2_unsigned_32_bits_are_grey(tmp_path: Path, bumps: Array) -> None:
    whole = np.rint(bumps * (2**32 - 1)).astype(np.uint32)
    tifffile.imwrite(tmp_path / "a.tif", whole, photometric="minisblack")
    np.testing.assert_allclose(
        load_height_map(tmp_path / "a.tif", relief_mm=1.2).heights, 1.2 * bumps, atol=1e-9
    )
    np.testing.assert_allclose(prepare(tmp_path / "a.tif", relief_mm=1.2).heights, 1.2 * bumps, atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "hole", "says_so"),
    [
        ("float32", -9999.0, True),
        ("float32", -3.4028234663852886e38, True),
        ("int16", -32768.0, True),
        ("float32", np.nan, False),
        ("float64", -np.inf, False),
        ("float32", -9999.0, False),
        ("int16", -32768.0, False),
    ],
)
def test_a3_what_was_not_measured_is_a_hole(
    tmp_path: Path, bumps: Array, kind: str, hole: float, says_so: bool
) -> None:
    file, heights = tmp_path / "a.tif", (300.0 + 700.0 * bumps).astype(kind)
    heights[:10] = hole
    tags = [(42113, "s", 0, repr(hole), True)] if says_so else []
    tifffile.imwrite(file, heights, photometric="minisblack", extratags=tags)
    assert "7.81 %" in fault(file, relief_mm=1.2) and "--fill" in fault(file, relief_mm=1.2)
    prepared = prepare(file, relief_mm=1.2, fill=True)
    assert prepared.numbers["holes_percent"] == pytest.approx(7.8125)
    ends = heights[10:].min(), heights[10:].max()
    expected = 1.2 * (heights[10:] - float(ends[0])) / (float(ends[1]) - float(ends[0]))
    # Whole numbers have steps of 1, which are smoothed by up to half of one.
    np.testing.assert_allclose(prepared.heights[10:], expected, atol=1e-3 if kind == "int16" else 1e-5)


def test_a5_metres_are_asked_for(tmp_path: Path, bumps: Array, caplog: pytest.LogCaptureFixture) -> None:
    tifffile.imwrite(tmp_path / "a.tif", (250e-6 * bumps).astype(np.float32))
    load_height_map(tmp_path / "a.tif")
    assert "0.25 µm high, less than a finger feels; are these metres? --height-scale 1000" in caplog.text
    scaled = load_height_map(tmp_path / "a.tif", height_scale=1000.0).heights
    np.testing.assert_allclose(scaled, 0.25 * bumps, rtol=1e-6)


@pytest.mark.parametrize("samples", [64, 128])
def test_a6_a_known_map_keeps_its_scale(tmp_path: Path, samples: int) -> None:
    rough = np.random.default_rng(5).standard_normal((512, 512))
    grey = np.rint((rough - rough.min()) / np.ptp(rough) * 65535).astype(np.uint16)
    Image.fromarray(grey).save(tmp_path / "a.png")
    whole = prepare(tmp_path / "a.png", relief_mm=0.6, samples=samples)
    known = prepare(tmp_path / "a.png", relief_mm=0.6, samples=samples, levels="0,255")
    np.testing.assert_allclose(whole.heights, known.heights, atol=1e-7)
    Image.fromarray(grey // 2).save(tmp_path / "a.png")
    line = prepare(tmp_path / "a.png", relief_mm=0.6, samples=samples).done["levels"]
    assert "stretched 2-fold; --levels 0,255 keeps the picture's own scale" in line


def test_a7_colours_that_are_data_are_refused_with_the_word(tmp_path: Path, bumps: Array) -> None:
    down, right = np.gradient(20 * bumps)
    up = 1 / np.sqrt(right**2 + down**2 + 1)
    normals = np.rint(127.5 * np.dstack([-right * up, down * up, up]) + 127.5).astype(np.uint8)
    Image.fromarray(normals).save(tmp_path / "normal.png")
    packed = np.rint((10300 + 700 * bumps) * 10).astype(int)
    bytes_ = np.dstack([packed >> 16 & 255, packed >> 8 & 255, packed & 255]).astype(np.uint8)
    Image.fromarray(bytes_).save(tmp_path / "packed.png")
    assert fault(tmp_path / "normal.png", relief_mm=1.0).count("normal map") == 2
    assert fault(tmp_path / "packed.png", relief_mm=1.0).count("packed over several bytes") == 2


def test_b1_deep_exr_takes_one_line(tmp_path: Path) -> None:
    depths, alphas = np.empty((32, 32), object), np.empty((32, 32), object)
    for place in np.ndindex(32, 32):
        count = sum(place) % 3
        depths[place] = np.arange(count, dtype=np.float32) if count else None
        alphas[place] = np.ones(count, np.float32) if count else None
    header = {"compression": OpenEXR.ZIPS_COMPRESSION, "type": OpenEXR.deepscanline}
    OpenEXR.File(header, {"Z": depths, "A": alphas}).write(str(tmp_path / "a.exr"))
    assert fault(tmp_path / "a.exr").count("deep data") == 2


@pytest.mark.parametrize("kind", ["float64", "float16", "float32", "colour", "alpha"])
def test_b2_numbers_of_every_type_are_read(tmp_path: Path, bumps: Array, kind: str) -> None:
    file, heights = tmp_path / "a.tif", 1.2 * bumps
    if kind == "colour":
        tifffile.imwrite(file, np.repeat(heights.astype(np.float32)[..., None], 3, 2), photometric="rgb")
    elif kind == "alpha":
        grey = np.rint(bumps * 65535).astype(np.uint16)
        layers = np.stack([grey, grey | 65535], -1)
        tifffile.imwrite(file, layers, photometric="minisblack", extrasamples=["unassalpha"])
    else:
        tifffile.imwrite(file, heights.astype(kind))
    read = load_height_map(file, relief_mm=1.2 if kind == "alpha" else None).heights
    np.testing.assert_allclose(read, heights, atol=1e-3 if kind == "float16" else 1e-5)


@pytest.mark.parametrize(
    ("name", "most"), [("norm16", 0.85), ("stretch8", 0.87), ("lev16", 3.2), ("low8", 0.9)]
)
def test_b3_steps_are_found_by_their_values(tmp_path: Path, name: str, most: float) -> None:
    """Root mean square error of slopes, degrees, on 10 mm with 1.2 mm of relief."""
    low = np.rint(40 + 60 * _bumps(256))
    normalised = (low - low.min()) / np.ptp(low)
    grey: NDArray[np.generic] = {
        "low8": low.astype(np.uint8),
        "norm16": np.rint(normalised * 65535).astype(np.uint16),
        "stretch8": np.rint(normalised * 255).astype(np.uint8),
        "lev16": (np.rint(_bumps(256) * 15) * 17).astype(np.uint8),
    }[name]
    Image.fromarray(grey).save(tmp_path / "a.png")
    np.save(tmp_path / "true.npy", _bumps(256))
    prepared = prepare(tmp_path / "a.png", relief_mm=1.2)
    true = prepare(tmp_path / "true.npy", relief_mm=1.2)
    slopes = [np.arctan(np.hypot(*np.gradient(one.heights, 10 / 128))) for one in (prepared, true)]
    angles = np.degrees(slopes[0] - slopes[1])
    assert "smoothed" in prepared.done["steps"]
    assert np.sqrt(np.mean(angles**2)) < most
    assert "levels, steps of" in (terraces(load_height_map(tmp_path / "a.png", relief_mm=1.2).heights) or "")


def test_b4_micrometres_about_their_mean(tmp_path: Path, bumps: Array) -> None:
    heights = (250 * (bumps - 0.5)).astype(np.float32)
    tifffile.imwrite(tmp_path / "a.tif", heights)
    prepared = prepare(tmp_path / "a.tif", units="um")
    np.testing.assert_allclose(prepared.heights, 0.25 * bumps, atol=1e-6)
    with pytest.raises(InputError, match=r"retouch\.prepare\(.*height_scale=0.001") as caught:
        load_height_map(tmp_path / "a.tif", height_scale=0.001)
    assert "--level" in caught.value.for_command and "retouch prepare" in caught.value.for_command
    heights[5, 5] = np.nan
    tifffile.imwrite(tmp_path / "a.tif", heights)
    levelled = load_height_map(tmp_path / "a.tif", height_scale=0.001, level=True, fill=True).heights
    assert levelled.min() == 0.0 and np.ptp(levelled) == pytest.approx(0.25, rel=0.1)


def test_c2_a_signalling_nan_is_a_hole_without_a_warning(tmp_path: Path, bumps: Array) -> None:
    heights = bumps.astype(np.float32)
    heights.view(np.uint32)[:3] = 0x7FA00000
    tifffile.imwrite(tmp_path / "a.tif", heights)
    assert "2.3" in fault(tmp_path / "a.tif", relief_mm=1.0)


def test_c3_a_jpeg_by_the_name_of_a_png(tmp_path: Path, bumps: Array) -> None:
    file = tmp_path / "a.png"
    Image.fromarray(np.rint(bumps * 255).astype(np.uint8)).save(file, format="JPEG")
    with pytest.raises(InputError, match="holds a JPEG in grey, not a height map; make a height map of it"):
        load_height_map(file, relief_mm=1.0)
    assert prepare(file, relief_mm=1.0).heights.shape == (128, 128)


def test_c4_a_tile_says_how_many_pixels_are_missing(tmp_path: Path) -> None:
    grey = np.random.default_rng(0).integers(0, 9, (16, 16), np.uint8).cumsum(axis=1, dtype=np.uint8)
    Image.fromarray(grey).save(tmp_path / "a.png")
    with pytest.raises(InputError, match="16 pixels a side needs a picture of at least 20"):
        prepare(tmp_path / "a.png", relief_mm=0.5, tile="auto")


def test_c6_pixels_that_are_not_square_and_parts_of_a_picture(tmp_path: Path, bumps: Array) -> None:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    heights = bumps.astype(np.float32)
    OpenEXR.File(header | {"pixelAspectRatio": 2.0}, {"Y": heights}).write(str(tmp_path / "aspect.exr"))
    assert fault(tmp_path / "aspect.exr").count("2 times as wide as high") == 2
    windows = {"dataWindow": ((64, 0), (191, 127)), "displayWindow": ((0, 0), (255, 127))}
    corners = {key: tuple(np.array(one, np.int32) for one in ends) for key, ends in windows.items()}
    OpenEXR.File(header | corners, {"Y": heights}).write(str(tmp_path / "window.exr"))
    assert (
        "128 x 128 pixels at (64, 0) of a picture of 256 x 128"
        in prepare(tmp_path / "window.exr").done["picture"]
    )


def test_c7_what_repeats_already_stays_as_it_is(tmp_path: Path) -> None:
    Image.fromarray(np.rint(_bumps(256) * 65535).astype(np.uint16)).save(tmp_path / "a.png")
    prepared = prepare(tmp_path / "a.png", relief_mm=0.6, samples=64, tile="auto")
    assert prepared.repeats and prepared.numbers["tile"]["pixels"] == 256
    # The weighted mean of a shifted picture is the shifted mean, also across the border.
    Image.fromarray(np.rint(np.roll(_bumps(256), (128, 128), (0, 1)) * 65535).astype(np.uint16)).save(
        tmp_path / "shifted.png"
    )
    shifted = prepare(tmp_path / "shifted.png", relief_mm=0.6, samples=64, tile="auto")
    np.testing.assert_allclose(np.roll(shifted.heights, (-32, -32), (0, 1)), prepared.heights, atol=1e-6)


@pytest.mark.parametrize(("colour", "layers"), [(2, 3), (4, 2)])
def test_c8_sixteen_bits_of_colour(tmp_path: Path, bumps: Array, colour: int, layers: int) -> None:
    grey = np.rint(bumps * 65535).astype(">u2")
    stack = [grey] * 3 if layers == 3 else [grey, np.full_like(grey, 65535)]
    rows = b"".join(b"\0" + row.tobytes() for row in np.dstack(stack).astype(">u2"))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 128, 128, 16, colour, 0, 0, 0)
    parts = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + parts)
    np.testing.assert_allclose(
        prepare(tmp_path / "a.png", relief_mm=1.2).heights, 1.2 * grey / 65535.0, atol=1e-6
    )


def test_d1_a_surface_as_gwyddion_writes_it(tmp_path: Path) -> None:
    pytest.importorskip("SurfaceTopography")
    y, x = np.mgrid[0:120, 0:160]
    heights = 1e-4 * (1 + np.sin(x / 7) * np.sin(y / 9))
    heights[:20, :30] = 3e-4
    head = ["# Channel: Topography", "# Width: 12.00 mm", "# Height: 9.000 mm", "# Value units: m"]
    rows = ["\t".join(f"{value:.6e}" for value in row) for row in heights]
    (tmp_path / "a.txt").write_text("\n".join(head + rows) + "\n")
    read = load_height_map(tmp_path / "a.txt")
    assert read.size_mm == 12.0 and read.heights.shape == (120, 160)
    np.testing.assert_allclose(read.heights, 1e3 * (heights - heights.min()), atol=1e-6)
    prepared = prepare(tmp_path / "a.txt")
    assert prepared.size_mm == 9.0 and prepared.relief_mm == pytest.approx(0.3, rel=1e-3)
