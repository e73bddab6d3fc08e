"""Scans are read from height maps with holes, meshes and points; hostile files are refused in one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr, save_heights_png
from relief.relief import Relief
from relief.scans.scan_files import ScanLengths, read_scan
from relief.scans.scans import Scan
from relief.solids.export.plate_export import export_plate
from tests.relief.scans.conftest import scan_of


@pytest.fixture(scope="module")
def scan(design: Relief) -> Scan:
    return scan_of(design, holes=0.05)


def points(scan: Scan) -> np.ndarray:
    """(n, 3) points of a scan."""
    x, y = np.meshgrid(*scan.axes_mm())
    return np.column_stack([each[scan.measured] for each in (x, y, scan.heights)])


def test_a_height_map_has_holes_where_it_is_not_finite(scan: Scan, tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "scan.exr", scan.heights, scan.size_mm[1])
    read = read_scan(tmp_path / "scan.exr")
    assert read.pitch_mm == pytest.approx(scan.pitch_mm)
    np.testing.assert_allclose(read.heights[read.measured].mean(), np.nanmean(scan.heights), atol=1e-5)
    np.save(tmp_path / "scan.npy", scan.heights * 1000.0)
    read = read_scan(tmp_path / "scan.npy", ScanLengths(size_mm=scan.size_mm[1], height_scale=0.001))
    assert np.nanmax(read.heights) == pytest.approx(np.nanmax(scan.heights))


def test_a_picture_needs_its_lengths(tmp_path: Path) -> None:
    save_heights_png(tmp_path / "scan.png", np.random.default_rng(0).uniform(0.0, 1.0, (40, 40)), None)
    with pytest.raises(InputError, match=r"scan\.png: size_mm: missing; the width of the scan"):
        read_scan(tmp_path / "scan.png")
    with pytest.raises(InputError, match="relief_mm: missing; a picture needs the height of white"):
        read_scan(tmp_path / "scan.png", ScanLengths(size_mm=8.0))
    assert read_scan(tmp_path / "scan.png", ScanLengths(size_mm=8.0, relief_mm=0.5)).heights.max() <= 0.5


def test_points_on_a_grid_are_its_samples(scan: Scan, tmp_path: Path) -> None:
    rows = np.random.default_rng(0).permutation(points(scan))
    np.savetxt(tmp_path / "scan.xyz", rows, fmt="%.6f")
    read = read_scan(tmp_path / "scan.xyz")
    assert read.pitch_mm == pytest.approx(scan.pitch_mm, rel=1e-3) and read.variance_mm2 == 0.0
    assert np.count_nonzero(read.measured) == len(rows)
    np.testing.assert_allclose(np.sort(read.heights[read.measured]), np.sort(rows[:, 2]), atol=1e-6)


def test_points_on_no_grid_are_joined(scan: Scan, tmp_path: Path) -> None:
    rows = points(scan)
    rows[:, :2] += np.random.default_rng(0).normal(0.0, 0.03, (len(rows), 2))
    np.savetxt(tmp_path / "scan.csv", rows / 25.4, fmt="%.8f", delimiter=";", header="x;y;z", comments="")
    read = read_scan(tmp_path / "scan.csv", ScanLengths(units="in"))
    assert read.pitch_mm == pytest.approx(scan.pitch_mm, rel=0.1)
    assert read.variance_mm2 == pytest.approx(read.pitch_mm**2 / 6.0, rel=0.02)
    assert np.nanmean(read.heights) - np.nanmin(read.heights) == pytest.approx(
        rows[:, 2].mean() - rows[:, 2].min(), abs=0.05
    )


def test_a_mesh_is_seen_from_above(tmp_path: Path) -> None:
    heights = np.random.default_rng(0).uniform(0.2, 0.8, (30, 40))
    export_plate(tmp_path / "scan.stl", heights, 8.0)
    read = read_scan(tmp_path / "scan.stl")
    assert read.size_mm == pytest.approx((6.0, 8.0), rel=0.06)
    assert read.hole_share < 0.05
    assert np.ptp(read.heights[read.measured]) == pytest.approx(np.ptp(heights), rel=0.25)


def test_a_leaning_surface_is_set_upright(tmp_path: Path) -> None:
    x, y = (each.ravel() for each in np.meshgrid(np.linspace(0, 8, 41), np.linspace(0, 8, 41)))
    flat = np.column_stack([x, y, 0.2 * np.sin(3.0 * x)])
    angle = np.radians(50.0)
    turn = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    index = np.arange(41 * 41).reshape(41, 41)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    text = [f"v {p[0]:.6f} {p[1]:.6f} {p[2]:.6f}" for p in flat @ turn.T]
    text += [f"f {f[0] + 1} {f[1] + 1} {f[2] + 1}" for f in faces]
    (tmp_path / "scan.obj").write_text("\n".join(text))
    read = read_scan(tmp_path / "scan.obj")
    assert read.size_mm == pytest.approx((8.0, 8.0), rel=0.05)
    assert np.nanstd(read.heights) == pytest.approx(np.std(flat[:, 2]), rel=0.1)


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("scan.xyz", b"1 2 three\n" * 400, "0 points; at least 256"),
        ("scan.xyz", b"1 2\n" * 400, "not lines of x, y and z: line 1: invalid column"),
        ("scan.xyz", b"\0\1\2" * 400, "is no text of numbers"),
        ("scan.xyz", b"0 0 1\n" * 20, "at least 256 are needed"),
        ("scan.csv", b"".join(b"%d,%d,1\n" % (n, n) for n in range(400)), "line"),
        ("scan.stl", b"solid nothing", "scan.stl"),
        ("scan.exr", b"nothing", "damaged or not an EXR"),
        ("scan.doc", b"", "not a scan"),
    ],
)
def test_what_is_no_scan_is_refused(tmp_path: Path, name: str, content: bytes, line: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=line):
        read_scan(tmp_path / name, ScanLengths())


def test_lengths_of_another_kind_of_file_are_refused(scan: Scan, tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "scan.exr", scan.heights, scan.size_mm[1])
    for lengths, line in (
        (ScanLengths(units="mm", height_scale=2.0), "units: is another scale than height_scale"),
        (ScanLengths(relief_mm=1.0), "relief_mm: is for another kind"),
    ):
        with pytest.raises(InputError, match=line):
            read_scan(tmp_path / "scan.exr", lengths)
    (tmp_path / "scan.xyz").write_text("0 0 0\n")
    with pytest.raises(InputError, match="size_mm: is for height maps"):
        read_scan(tmp_path / "scan.xyz", ScanLengths(size_mm=1.0))


def test_the_unit_of_a_height_map_is_that_of_its_heights(scan: Scan, tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "scan.exr", 1e3 * scan.heights, scan.size_mm[1])
    read = read_scan(tmp_path / "scan.exr", ScanLengths(units="um"))
    np.testing.assert_allclose(read.heights, scan.heights, rtol=1e-6)
    save_heights_png(tmp_path / "scan.png", np.full((40, 40), 0.5), 3.0, scan.size_mm[1])
    with pytest.raises(InputError, match="units: is for another kind of height map; this one holds grey"):
        read_scan(tmp_path / "scan.png", ScanLengths(units="um"))


def test_more_holes_than_surface_are_refused(scan: Scan, tmp_path: Path) -> None:
    holed = scan.heights.copy()
    holed[np.random.default_rng(0).random(holed.shape) < 0.6] = np.nan
    save_heights_exr(tmp_path / "scan.exr", holed, scan.size_mm[1])
    with pytest.raises(InputError, match=r"more holes than surface: 6\d % of it holds no height"):
        read_scan(tmp_path / "scan.exr")
    save_heights_exr(tmp_path / "none.exr", np.full((20, 20), np.nan), 8.0)
    with pytest.raises(InputError, match="holds no height at all"):
        read_scan(tmp_path / "none.exr")


def test_noise_is_told_of_a_scan(design: Relief) -> None:
    fine = scan_of(design, noise_mm=0.05)
    assert fine.noise_mm == pytest.approx(0.05, rel=0.15)


def test_blocks_keep_places() -> None:
    plane = Scan(np.add.outer(-np.arange(21.0), np.arange(34.0)), 0.1)
    for times in (2, 3, 5):
        coarse = plane.averaged(times)
        x, y = np.meshgrid(*coarse.axes_mm())
        whole = coarse.measured
        whole[-1:], whole[:, -1:] = False, False
        # On a plane with slopes of 10 a mm, the mean of a block is the height of its middle.
        np.testing.assert_allclose(coarse.heights[whole], (10.0 * (x + y) + 6.5)[whole], atol=1e-9)
    cut = plane.cut(plane.heights[3:, 5:], 3, 5)
    assert replace(cut).axes_mm()[0][0] == pytest.approx(plane.axes_mm()[0][5])
