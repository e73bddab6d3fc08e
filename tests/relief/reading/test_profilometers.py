"""Measured surfaces: size, unit, holes, rows and columns of small files that the tests write."""

import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest
import tifffile

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import holds_mm, load_height_map
from relief.reading.profilometers import is_measured
from relief.reading.readers import read_samples
from relief.reading.surface_topography import read_surface
from relief.scans.scan_files import ScanLengths, read_scan

pytest.importorskip("SurfaceTopography")


def bumps(rows: int = 40, cols: int = 60) -> Array:
    """(rows, cols) heights from 1 to 3 without a symmetry, the highest at row 0, column 0."""
    y, x = np.mgrid[0:rows, 0:cols]
    heights = 1.5 + 0.5 * np.sin(x / 5.0) * np.cos(y / 7.0)
    heights[:6, :9] = 3.0
    heights[-1, -1] = 1.0
    return heights


def sdf(path: Path, heights: Array, pitch_um: tuple[float, float] = (100.0, 100.0)) -> Path:
    """A file by ISO 25178-71 as text: heights in µm, BAD where nothing was measured."""
    rows, cols = heights.shape
    head = {"ManufacID": "TEST", "NumPoints": cols, "NumProfiles": rows}
    head |= {"Xscale": 1e-6 * pitch_um[0], "Yscale": 1e-6 * pitch_um[1], "Zscale": 1e-6, "DataType": 7}
    lines = ["aISO-1.0", *(f"{key} = {value}" for key, value in head.items()), "*"]
    lines += [" ".join("BAD" if np.isnan(one) else repr(float(one)) for one in row) for row in heights]
    path.write_text("\n".join([*lines, "*"]) + "\n")
    return path


def sur(path: Path, heights: Array, pitch_mm: float = 0.1) -> Path:
    """A file of Digital Surf: 16-bit steps of 1 nm about the mean; not a number is a special point."""
    steps = np.rint((heights - np.nanmean(heights)) * 1000.0)
    low, high = int(np.nanmin(steps)), int(np.nanmax(steps))
    rows, cols = heights.shape
    header = struct.pack("<12s4H30s30s5H8x", b"DIGITAL SURF", 0, 1, 1, 1, b"", b"", 0, 0, 0, 1, 1)
    header += struct.pack("<HiiiiI3f", 16, low, high, cols, rows, rows * cols, pitch_mm, pitch_mm, 1e-3)
    units = [b"mm", b"mm", b"um"] * 2
    header += struct.pack("<9s7x16s16s" + 6 * "16s", b"X", b"Y", b"Z", *units) + struct.pack("<3f", 1, 1, 1)
    path.write_bytes(header.ljust(512, b"\0") + np.nan_to_num(steps, nan=low - 2).astype("<i2").tobytes())
    return path


def gwyddion(path: Path, heights: Array, head: str) -> Path:
    """A text as Gwyddion writes it: heights in m of heights in µm."""
    lines = ["\t".join(f"{1e-6 * value:.9e}" for value in row) for row in heights]
    path.write_bytes((head + "\n".join(lines) + "\n").encode("latin-1"))
    return path


HEAD = "# Channel: Topography\n# Width: 12.00 mm\n# Height: 8.000 mm\n# Value units: m\n"
GERMAN = "# Kanal: H\xf6he\n# Breite: 12000 \xb5m\n# H\xf6he: 8.000 mm\n# Einheiten: m\n"


def park(path: Path, heights: Array, side_um: float) -> Path:
    """A TIFF of Park Systems: a thumbnail in colours, and heights in µm from the bottom in a tag."""
    rows, cols = heights.shape
    text = "Z Height".encode("utf-16-le").ljust(64, b"\0")
    header = struct.pack(
        "<I64s16sdIIIIdIdIII4d", 0, text, b"", 0, 0, 0, cols, rows, 0, 0, 0, 1, 1, 0, *4 * [0]
    )
    header = header[:-32] + struct.pack("<4d", side_um, side_um, 0, 0) + struct.pack("<dd16s", 0, 0, b"")
    unit = "um".encode("utf-16-le")
    header += struct.pack("<5d16s6i", 0, 0, 1, 1, 0, unit, 0, 0, 0, 0, 0, 1)
    header += struct.pack("<dd16s16s16s3Idd32s", 0, 0, b"", b"", b"", 2, 0, 0, 0, 0, b"")
    data = heights[::-1].astype("<f4").tobytes()
    tags: list[tuple[int, str, int, object, bool]] = [(50432, "I", 1, 0x0E031301, True)]
    tags += [(50433, "I", 1, 0x1000002, True)]
    tags += [(50434, "B", len(data), data, True), (50435, "B", len(header), header, True)]
    thumbnail = np.zeros((8, 8, 3), np.uint8)
    tifffile.imwrite(path, thumbnail, photometric="rgb", extratags=tags, metadata=None)
    return path


def written(kind: str, folder: Path, heights: Array) -> Path:
    if kind == "sdf":
        return sdf(folder / "a.sdf", heights, (200.0, 200.0))
    if kind == "sur":
        return sur(folder / "a.SUR", heights, 0.2)
    if kind == "park":
        return park(folder / "a.tiff", heights, 8000.0)
    return gwyddion(folder / "a.txt", heights, GERMAN if kind == "german" else HEAD)


@pytest.mark.parametrize("kind", ["sdf", "sur", "park", "gwyddion", "german"])
def test_rows_columns_size_and_unit(tmp_path: Path, kind: str) -> None:
    heights = bumps(40, 40) if kind == "park" else bumps()
    path = written(kind, tmp_path, heights)
    assert is_measured(path)
    assert holds_mm(path)
    header, stored = read_surface(path)
    cols = heights.shape[1]
    assert header["lengths"]["size_mm"] == pytest.approx(12.0 if cols == 60 else 8.0, rel=1e-6)
    unit_um = 1000.0 * header["unit_mm"]
    np.testing.assert_allclose(
        stored * unit_um - np.mean(stored * unit_um), heights - heights.mean(), atol=6e-4
    )


@pytest.mark.slow
def test_height_map_and_scan_of_a_measured_surface(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """In a process of its own: lowest lifted to 0, mm, the channel reported; texts of points stay points."""
    path = gwyddion(tmp_path / "a.txt", bumps() - 2.0, HEAD)
    read = load_height_map(path)
    assert read_samples(path).notes == ("channel Topography",)
    assert read.size_mm == pytest.approx(12.0)
    np.testing.assert_allclose(read.heights, 1e-3 * (bumps() - 1.0), atol=1e-9)
    scan = read_scan(path)
    assert scan.pitch_mm == pytest.approx(0.2)
    np.testing.assert_allclose(np.ptp(scan.heights), 0.002, rtol=1e-6)
    table = tmp_path / "table.csv"
    np.savetxt(table, bumps(), delimiter=",")
    np.testing.assert_allclose(read_scan(table, ScanLengths(size_mm=6.0)).pitch_mm, 0.1)
    y, x = np.mgrid[0:20, 0:20]
    np.savetxt(tmp_path / "points.csv", np.column_stack([x.ravel(), y.ravel(), x.ravel(), y.ravel()]))
    assert read_scan(tmp_path / "points.csv").heights.shape == (20, 20)


def test_what_was_not_measured_is_a_hole(tmp_path: Path) -> None:
    heights = bumps()
    heights[10:14, 20:25] = np.nan
    for path in (sdf(tmp_path / "a.sdf", heights), sur(tmp_path / "a.sur", heights)):
        assert np.array_equal(np.isnan(read_surface(path)[1]), np.isnan(heights))
    heights[:] = np.nan
    with pytest.raises(InputError, match=r"b\.sdf: nothing was measured$"):
        read_surface(sdf(tmp_path / "b.sdf", heights))


def test_samples_that_are_not_square(tmp_path: Path) -> None:
    """Rows twice as far apart as columns: twice as many rows, waves kept, and a hole of the same size."""
    y, x = np.mgrid[0:30, 0:60]
    wave = 2.0 + np.sin(0.5 * (y + 0.5)) + 0.1 * np.cos(0.3 * x)
    wave[10:14, 20:30] = np.nan
    header, heights = read_surface(sdf(tmp_path / "a.sdf", wave, (100.0, 200.0)))
    assert header["notes"] == ["channel Default", "resampled from 60 x 30 samples, which are not square"]
    assert heights.shape == (60, 60)
    assert header["lengths"]["size_mm"] == pytest.approx(6.0)
    y, x = np.mgrid[0:60, 0:60]
    fine = 2.0 + np.sin(0.5 * (y + 0.5) / 2.0) + 0.1 * np.cos(0.3 * x)
    assert np.array_equal(np.argwhere(np.isnan(heights)).min(axis=0), [20, 20])
    assert np.count_nonzero(np.isnan(heights)) == 80
    rest = np.isfinite(heights)
    rest[:8] = rest[-8:] = rest[12:36] = False
    assert np.abs(heights - fine)[rest].max() < 0.003


@pytest.mark.parametrize(
    ("pitch_um", "shape", "line"),
    [
        ((5.0, 10.0), (40, 60), "0.3 x 0.4 mm; at least 1 mm are needed under a finger"),
        ((2000.0, 2000.0), (40, 60), "120 x 80 mm; at most 100 mm a side are read"),
        ((1.0, 100.0), (60, 40), "40 x 6000 square samples; at most 4096 a side are read"),
        ((1.0, 1e-6), (16, 16), "16000000 x 16 square samples; at most 4096 a side are read"),
    ],
)
def test_sizes_that_are_not_read(
    tmp_path: Path, pitch_um: tuple[float, float], shape: tuple[int, int], line: str
) -> None:
    path = sdf(tmp_path / "a.sdf", bumps(*shape), pitch_um)
    with pytest.raises(InputError) as refused:
        read_surface(path)
    assert str(refused.value) == f"{path}: {line}"


def test_profiles_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.hfm"
    path.write_text("X;Y;valid\n[mm];[mm];[1/0]\n" + "\n".join(f"{0.01 * n};{n % 7};1" for n in range(400)))
    with pytest.raises(InputError, match=r"a\.hfm: holds a profile along a line; a height map is a surface$"):
        read_surface(path)


@pytest.mark.slow
def test_size_and_unit_that_the_file_lacks(tmp_path: Path) -> None:
    path = gwyddion(tmp_path / "a.txt", bumps(), "# Width: 12.00 mm\n# Height: 8.000 mm\n")
    with pytest.raises(InputError) as refused:
        load_height_map(path)
    assert refused.value.for_command.startswith(f"{path}: --height-scale: missing")
    with pytest.raises(InputError) as refused:
        load_height_map(path, height_scale=1000.0)
    assert refused.value.for_command.startswith(f"{path}: --size-mm: missing")
    read = load_height_map(path, height_scale=1e3, size_mm=12.0)
    np.testing.assert_allclose(read.heights, 1e-3 * (bumps() - 1.0), atol=1e-9)


def test_a_damaged_file_is_no_plain_text(tmp_path: Path) -> None:
    path = sdf(tmp_path / "a.sdf", bumps())
    path.write_text(path.read_text().replace("Zscale = 1e-06", "Zscale = 1,0"))
    with pytest.raises(InputError, match=r"a\.sdf: damaged or not a measured surface: "):
        read_surface(path)


def test_damaged_files_are_a_line(tmp_path: Path) -> None:
    content = sur(tmp_path / "whole.sur", bumps()).read_bytes()
    path = tmp_path / "a.sur"
    for damaged in (content[:-3], content[:200], b"", b"nothing of the kind" * 9, b"\0" * 600):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"a\.sur: damaged or not a measured surface: "):
            read_surface(path)
    # Its header promises 2^31 - 1 columns.
    path.write_bytes(content[:108] + struct.pack("<i", 2**31 - 1) + content[112:])
    with pytest.raises(InputError, match=r"a\.sur: "):
        read_surface(path)


def test_archives_that_unpack_to_more_are_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "a.x3p"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bindata/data.bin", bytes(1 << 20))
    # The entry of the directory states the size that unpacking would have.
    content = bytearray(path.read_bytes())
    at = content.rindex(b"PK\x01\x02") + 24
    content[at : at + 4] = struct.pack("<I", 1 << 29)
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"a\.x3p: holds 536870912 bytes; at most 268435456 are read$"):
        read_surface(path)


def test_a_process_that_dies_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = sdf(tmp_path / "a.sdf", bumps())
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(
        InputError, match=r"a\.sdf: damaged .*: the process that reads it ended with status 1$"
    ):
        read_samples(path)


@pytest.mark.slow
def test_nothing_is_printed_but_heights(tmp_path: Path) -> None:
    """Warnings of the library and of what it imports stay inside, on import as well."""
    path = sdf(tmp_path / "a.sdf", bumps(16, 16))
    command = [sys.executable, "-W", "always", "-m", "relief.reading.surface_topography", str(path)]
    child = subprocess.run(command, capture_output=True, check=True)
    assert child.stderr == b""
    assert len(child.stdout.partition(b"\n")[2]) == 8 * 16 * 16


def test_without_the_extra_a_line_names_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = sdf(tmp_path / "a.sdf", bumps())
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    with pytest.raises(InputError) as refused:
        load_height_map(path)
    assert str(refused.value) == f"{path}: needs the extra metrology: pip install 'retouch[metrology]'"


@pytest.mark.parametrize(
    "text", ["1 2 3\n4 5 6\n", "ncols 2\nnrows 1\n1 2\n", "x,y,z\n1,2,3\n", "# Width\n1 2\n"]
)
def test_texts_without_an_instruments_heading_are_not_the_librarys(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.txt"
    path.write_text(text)
    assert not is_measured(path)
