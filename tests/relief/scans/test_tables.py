"""Texts of scans as instruments and programs write them: points, tables of heights, what was not measured."""

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.ground.progress import Progress, progress
from relief.scans.coupon import coupon, fields, window
from relief.scans.coupon_reading import read_coupon
from relief.scans.registration import register
from relief.scans.scan_files import ScanLengths, read_scan
from relief.scans.scans import Scan, check_scan
from tests.relief.scans.conftest import texture

SIDE = 24
Z = np.round(texture(3).heights[:SIDE, :SIDE], 5)
X, Y = np.meshgrid(np.arange(SIDE) * 0.1, np.arange(SIDE)[::-1] * 0.1)
HOLES = np.random.default_rng(0).random(Z.shape) < 0.05
UM = ScanLengths(height_scale=0.001)
TABLE = ScanLengths(size_mm=0.1 * SIDE, units="um")


def points(*columns: np.ndarray, sign: str = " ", point: str = ".") -> list[str]:
    """A point in each line."""
    rows = zip(*(column.flat for column in columns), strict=True)
    return [sign.join(f"{value:.5f}".replace(".", point) for value in row) for row in rows]


def rows(heights: np.ndarray, sign: str = ",", point: str = ".", hole: str = "nan") -> list[str]:
    """A row of heights in each line."""
    return [sign.join(f"{v:.2f}".replace(".", point).replace("nan", hole) for v in row) for row in heights]


def read(folder: Path, name: str, lines: list[str], lengths: ScanLengths | None = None) -> Scan:
    (folder / name).write_text("\n".join(lines) + "\n")
    return read_scan(folder / name, lengths)


def check(scan: Scan, heights: np.ndarray = Z) -> None:
    assert scan.pitch_mm == pytest.approx(0.1) and scan.variance_mm2 == 0.0
    np.testing.assert_allclose(scan.heights, heights, atol=2e-5)


@contextmanager
def lines_of() -> Iterator[list[str]]:
    """The lines for a person that the block reports."""
    found: list[str] = []

    def listener(state: Progress) -> None:
        found.append(state.stage)

    with progress(listener):
        yield found


@pytest.mark.parametrize(
    ("name", "lines"),
    [
        ("cloudcompare.asc", ["//X Y Z R G B", str(SIDE**2), *points(X, Y, Z, X, X, X)]),
        ("savetxt.csv", ["# z,x,y", *points(Z, X, Y, sign=",")]),
        ("other.csv", ["# z x y", *points(Z, X, Y, sign=",")]),
        ("units.txt", ["Z [mm] X [mm] Y [mm]", "mm mm mm", "", *points(Z, X, Y)]),
        ("numbered.csv", ['"no","x","y","z"', *points(np.arange(SIDE**2), X, Y, Z, sign=",")]),
        ("swapped.dat", ["Y\tX\tZ", *points(Y, X, Z, sign="\t")]),
        ("spreadsheet.csv", ["X;Y;Z", *points(X, Y, Z, sign=";", point=",")]),
        ("tabs.tsv", ["X (mm)\tY (mm)\tZ (mm)", *points(X, Y, Z, sign="\t", point=",")]),
        ("matlab.txt", [f"  {line}" for line in points(X, Y, Z, sign="   ")]),
        ("gom.asc", ["# 24 x 24 points of one scan", "#", "", *points(X, Y, Z), "", "# end"]),
        ("labelled.csv", [f"{line},point {n}" for n, line in enumerate(points(X, Y, Z, sign=","))]),
        ("organised.xyz", [*["nan nan nan"] * 9, *["-9999 -9999 -9999"] * 9, *points(X, Y, Z)]),
    ],
)
def test_points_of_other_programs(tmp_path: Path, name: str, lines: list[str]) -> None:
    check(read(tmp_path, name, lines))


def test_z_has_a_unit_of_its_own(tmp_path: Path) -> None:
    check(read(tmp_path, "a.txt", points(X, Y, 1e3 * Z, sign=","), UM))
    centimetres = ScanLengths(units="cm", height_scale=0.001)
    check(read(tmp_path, "b.xyz", points(X / 10, Y / 10, 1e3 * Z), centimetres))
    with pytest.raises(InputError, match="height_scale: 0 is not a number"):
        read(tmp_path, "c.xyz", points(X, Y, Z), ScanLengths(height_scale=0))
    with pytest.raises(InputError, match="relief_mm: is for height maps; points have units and height_scale"):
        read(tmp_path, "d.xyz", points(X, Y, Z), ScanLengths(relief_mm=1.0))


@pytest.mark.parametrize("columns", [(Z, X, Y), (np.round(Z, 2), X, Y), (X, Z, Y)])
def test_columns_in_another_order_without_a_name_are_refused(tmp_path: Path, columns: tuple) -> None:
    with pytest.raises(InputError, match=r"columns [12] and 3 lie on a grid, and not the first two"):
        read(tmp_path, "scan.xyz", points(*columns))


def test_lines_of_a_scanner_with_heights_of_few_digits_are_points_on_no_grid(tmp_path: Path) -> None:
    jittered = X + np.random.default_rng(0).normal(0.0, 0.02, X.shape)
    assert read(tmp_path, "scan.xyz", points(jittered, Y, np.round(Z, 3))).variance_mm2 > 0.0


@pytest.mark.parametrize("side", [90, 360])
@pytest.mark.parametrize(("sign", "point"), [(",", "."), (";", ","), ("\t", ","), (" ", ".")])
def test_a_table_of_heights_is_one(tmp_path: Path, side: int, sign: str, point: str) -> None:
    heights = texture(1).heights.repeat(6, axis=0).repeat(6, axis=1)[:side, :side]
    lines = rows(1e3 * heights, sign, point)
    line = (
        rf"missing; the width of the scan in mm, which the file, a grid of {side} x {side} heights, does not"
    )
    with pytest.raises(InputError, match=line):
        read(tmp_path, "scan.csv", lines)
    scan = read(tmp_path, "scan.csv", lines, ScanLengths(size_mm=9.0, height_scale=0.001))
    np.testing.assert_allclose(scan.heights, heights, atol=1e-5)
    with pytest.raises(InputError, match="16 columns or more, not points"):
        read(tmp_path, "scan.xyz", lines)


def test_twenty_lines_of_settings_are_above_a_table(tmp_path: Path) -> None:
    settings = ['"XY Calibration","100.0","um"', '"Horizontal","24"', '"Unit","um"', '"Comment",""'] * 5
    quoted = ['"' + line.replace(",", '","') + '"' for line in rows(1e3 * Z)]
    check(read(tmp_path, "scan.csv", [*settings, "", '"Height"', *quoted], TABLE))


NUMBERS = ("-9999", "-99999", "-32768.0", "9999", "-999.00", "-1e10", "1e38", "1.70141e38", "-3.4e38")
WORDS = ("Bad", "NaN", "---", "*****", "#N/A", "-1.#IND", "")


@pytest.mark.parametrize("hole", [*NUMBERS, *WORDS])
def test_what_was_not_measured_is_a_hole(tmp_path: Path, hole: str) -> None:
    holed = np.where(HOLES, np.nan, Z)
    with lines_of() as said:
        check(read(tmp_path, "table.csv", rows(1e3 * holed, hole=hole), TABLE), holed)
        lines = [line.replace("nan", hole) for line in points(X, Y, 1e3 * holed, sign=",")]
        check(read(tmp_path, "points.csv", lines, UM), holed)
    guessed = (
        f"{HOLES.sum()} of {HOLES.size} numbers are {float(hole or 'nan'):g}, " if hole in NUMBERS[:6] else ""
    )
    assert sum("far from the others: not measured" in line for line in said) == (2 if guessed else 0)
    assert not guessed or any(line.startswith(guessed) for line in said)


@pytest.mark.parametrize("number", [-5.0, 0.0, 2.0])
def test_heights_near_the_others_stay(tmp_path: Path, number: float) -> None:
    with lines_of() as said:
        check(
            read(tmp_path, "scan.xyz", points(X, Y, np.where(HOLES, number, Z))), np.where(HOLES, number, Z)
        )
    levels = np.where(HOLES, 999.0, 0.0)
    check(read(tmp_path, "levels.xyz", points(X, Y, levels), UM), 1e-3 * levels)
    assert not any("not measured" in line for line in said)


def test_a_height_without_a_place_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="1 of its points have a height, but x or y is"):
        read(tmp_path, "scan.xyz", ["Bad 0 0.3", *points(X, Y, Z)])


def test_a_message_names_the_line_of_the_file(tmp_path: Path) -> None:
    above = ["x y z", "", "# a comment", ""]
    for number, wrong, found in (
        (13, "1 2 0.3x", "could not convert string '0.3x'"),
        (5, "1 2", "invalid column"),
    ):
        lines = points(X, Y, Z)
        lines[number - 1] = wrong
        for headed in ([], above):
            line = f"line {number + len(headed)}: {found}"
            with pytest.raises(InputError, match=line):
                read(tmp_path, "scan.xyz", [*headed, *lines])
    table = rows(1e3 * Z)
    table[5] = f"{table[5]}x"
    with pytest.raises(InputError, match=r"line 8: could not convert string '[\d.]+x'"):
        read(tmp_path, "scan.csv", ["# heights", "", *table], TABLE)
    table[3] = table[3].rpartition(",")[0]
    with pytest.raises(InputError, match="line 6: the number of columns changed from 24 to 23"):
        read(tmp_path, "scan.csv", ["# heights", "", *table], TABLE)


FLAT = np.zeros((40, 40))
HIGH = np.where(np.arange(1600).reshape(40, 40) == 820, 1.0, FLAT)


@pytest.mark.slow
@pytest.mark.parametrize(
    "heights", [FLAT, HIGH, 1e29 * HIGH, FLAT + 1e9, FLAT + np.nan, HIGH * np.nan + HIGH]
)
@pytest.mark.parametrize("design", [texture(0), coupon()], ids=["texture", "coupon"])
def test_a_scan_without_relief_has_one_line_and_no_warning(heights: np.ndarray, design) -> None:
    warnings.simplefilter("error")
    with pytest.raises(InputError):
        register(check_scan(Scan(heights, design.width_mm / 40.0)), design)


def _holed(kinds: tuple[str, ...], hole: Callable[[np.ndarray], np.ndarray]) -> Scan:
    """A perfect coupon whose fields of these kinds have holes."""
    heights = coupon().heights.copy()
    for field in fields():
        if field.kind in kinds and (field.kind != "slope" or field.size > 40.0):
            part = heights[window(field)]
            part[hole(part)] = np.nan
    return Scan(heights, 24.0 / len(heights))


@pytest.mark.slow
def test_features_of_a_coupon_that_were_not_measured_are_not_said_to_come_out() -> None:
    warnings.simplefilter("error")
    with pytest.raises(InputError, match="no groove was measured along its middle"):
        read_coupon(_holed(("groove",), lambda part: part < 0.29), 1.0)
    slope = read_coupon(_holed(("slope",), lambda part: (part > 0.33) & (part < 0.85)), 1.0).max_slope_degrees
    assert (slope.value, slope.low, slope.high) == (30.0, 30.0, 90.0)
