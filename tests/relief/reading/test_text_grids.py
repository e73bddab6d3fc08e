"""Tables and ESRI grids as programs write them: headings, holes, coordinates, encodings, and their limits."""

import os
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.reading.readers import read_samples
from relief.reading.samples import Samples

NAN = np.nan
ROWS, COLS = 6, 7
HEIGHTS = np.round(np.random.default_rng(5).uniform(0.1, 0.9, (ROWS, COLS)), 4)
TILT = 0.25 * np.arange(ROWS)[:, None] + 0.5 * np.arange(COLS)
"""Heights of a plane, whose rows and columns are as even as coordinates."""
DELIMITERS = {",": ".csv", ";": ".csv", "\t": ".tsv", " ": ".txt"}
COORDINATES = "left out: a row and a column of coordinates"


def rows_of(heights: np.ndarray, sign: str = ",", point: str = ".") -> list[str]:
    """A line for each row."""
    return [sign.join(f"{height:g}".replace(".", point) for height in row) for row in heights]


def read(folder: Path, content: str | bytes | list[str], suffix: str = ".csv") -> Samples:
    """What is read of a file with this content, or these lines."""
    text = "\n".join(content) + "\n" if isinstance(content, list) else content
    path = folder / f"map{suffix}"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_samples(path)


def check(samples: Samples, heights: np.ndarray, *notes: str) -> None:
    np.testing.assert_allclose(samples.channels["Y"], heights, rtol=1e-6)
    assert samples.notes == notes


def refusal(folder: Path, content: str | bytes | list[str], suffix: str = ".csv") -> str:
    with pytest.raises(InputError) as refused:
        read(folder, content, suffix)
    line = str(refused.value)
    assert "\n" not in line and len(line) < 400 + len(str(folder))
    return line


HOLES = (
    *("BAD", "inf", "-inf", "N/A", "n/a", "NaN", "nan", "-nan", "---", "-", "*", "#N/A", "#NV", "#DIV/0!"),
    *("1.#QNAN", "NULL", "missing", "masked"),
)


@pytest.mark.parametrize("sign", DELIMITERS)
@pytest.mark.parametrize("hole", HOLES)
def test_a_word_for_a_hole_is_a_hole_in_every_row(tmp_path: Path, hole: str, sign: str) -> None:
    for places in (
        ((0, 0),),
        ((0, 3), (0, 4), (2, 1)),
        ((ROWS - 1, COLS - 1),),
        [(0, col) for col in range(7)],
    ):
        holed = HEIGHTS.copy()
        holed[tuple(zip(*places, strict=True))] = NAN
        lines = [line.replace("nan", hole) for line in rows_of(holed, sign)]
        check(read(tmp_path, lines, DELIMITERS[sign]), holed)


def test_a_strange_word_is_a_hole_where_it_is_in_later_rows_as_well(tmp_path: Path) -> None:
    holed = HEIGHTS.copy()
    holed[0] = holed[3, 2] = NAN
    check(read(tmp_path, [line.replace("nan", "hidden") for line in rows_of(holed)]), holed)


def test_a_first_line_of_words_and_numbers_is_left_out_with_a_note(tmp_path: Path) -> None:
    note = "left out: a first line with words"
    check(read(tmp_path, ["Leather,2024,,,,,", *rows_of(-HEIGHTS)]), -HEIGHTS, note)
    minus = [line.replace("-", "\N{MINUS SIGN}") for line in rows_of(-HEIGHTS)]
    check(read(tmp_path, ["sep=,", *minus]), -HEIGHTS)
    check(read(tmp_path, ["0.3,oops,0.2,1,1,1,1", *rows_of(HEIGHTS)]), HEIGHTS, note)


@pytest.mark.parametrize("sign", DELIMITERS)
@pytest.mark.parametrize(
    "names",
    [
        "h.0 h.1 h.2 h.3 h.4 h.5 h.6",
        "nanometres a b c d e f",
        "e1 e2 e3 e4 e5 e6 e7",
        "0mm 1mm 2mm 3mm 4mm 5mm 6mm",
    ],
)
def test_headings_are_no_heights(tmp_path: Path, names: str, sign: str) -> None:
    point = "." if sign == "," else ","
    units = sign.join(["nm"] * COLS)
    heading = names.replace(" ", sign)
    for above in (
        [heading],
        [heading, units],
        [f"# Heights of 2024{sign}{sign}", heading],
        [f'"{heading}"', units],
    ):
        check(read(tmp_path, [*above, *rows_of(HEIGHTS, sign, point)], DELIMITERS[sign]), HEIGHTS)


@pytest.mark.parametrize("sign", ",;\t")
@pytest.mark.parametrize("corner", ["", "y/x", '"y\\x"', "mm", "0"])
def test_coordinates_are_left_out_with_a_note(tmp_path: Path, corner: str, sign: str) -> None:
    for heights in (HEIGHTS, 0.01 * TILT, np.where(HEIGHTS > 0.7, NAN, HEIGHTS)):
        for x, y in (
            (range(COLS), range(ROWS)),
            (np.round(np.arange(COLS) / 3, 2), 5 - 0.25 * np.arange(ROWS)),
        ):
            lines = [f"{corner}{sign}{sign.join(map(str, x))}"]
            lines += [f"{y:g}{sign}{row}" for y, row in zip(y, rows_of(heights, sign), strict=True)]
            check(read(tmp_path, lines), heights, COORDINATES)


def test_rounded_coordinates_are_left_out(tmp_path: Path) -> None:
    heights = np.tile(HEIGHTS, (4, 4))
    for sign in ",;\t":
        lines = [sign + sign.join(f"{col / 80:.2f}" for col in range(28))]
        lines += [f"{-row / 30:.2f}{sign}{line}" for row, line in enumerate(rows_of(heights, sign))]
        check(read(tmp_path, lines), heights, COORDINATES)


def test_an_index_below_or_beside_names_is_left_out_with_a_note(tmp_path: Path) -> None:
    column = "left out: a column of coordinates"
    names = ",".join("abcdefg")
    numbered = [f"{row},{line}" for row, line in enumerate(rows_of(HEIGHTS))]
    check(read(tmp_path, [f",{names}", *numbered]), HEIGHTS, column)
    check(read(tmp_path, [f"y,{names}", *(f"0.{line}" for line in numbered)]), HEIGHTS, column)
    check(read(tmp_path, numbered), HEIGHTS, column)
    numbers = ",".join(map(str, range(COLS)))
    check(read(tmp_path, [numbers, *rows_of(HEIGHTS)]), HEIGHTS, "left out: a row of coordinates")
    # The language R gives the column of row numbers no name.
    check(
        read(tmp_path, [names.replace(",", " "), *(line.replace(",", " ") for line in numbered)]),
        HEIGHTS,
        column,
    )


@pytest.mark.parametrize("above", [[], ["a,b,c,d,e,f,g"]])
def test_even_heights_are_heights(tmp_path: Path, above: list[str]) -> None:
    wedge = np.tile(np.arange(COLS) / 10, (ROWS, 1))
    counted = np.arange(ROWS * COLS).reshape(ROWS, COLS)
    flat = np.full((ROWS, COLS), 0.5)
    for heights in (TILT, -TILT, wedge, 1.0 - wedge[:, ::-1] ** 2, counted, flat, HEIGHTS):
        check(read(tmp_path, [*above, *rows_of(heights)]), heights)
    tilted = TILT.copy()
    tilted[0, 0] = NAN
    check(read(tmp_path, [*above, *(line.replace("nan", "") for line in rows_of(tilted))]), tilted)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize(
    ("sign", "point"), [(",", "."), (";", ","), ("\t", ","), ("\t", "."), (" ", ","), (" ", ".")]
)
def test_texts_of_spreadsheets(tmp_path: Path, encoding: str, sign: str, point: str) -> None:
    holed = np.where(HEIGHTS > 0.7, NAN, HEIGHTS)
    lines = [line.replace("nan", "#N/A") for line in rows_of(holed, sign, point)]
    content = "\r\n".join([f"# Höhen in µm{sign}#1", *lines, ""])
    check(read(tmp_path, content.encode(encoding), ".txt"), holed)
    quoted = [sign.join(f'"{cell}"' for cell in line.split(sign)) for line in lines]
    check(read(tmp_path, quoted), holed)


def test_decimal_commas_in_quotes_between_commas(tmp_path: Path) -> None:
    check(read(tmp_path, [f'"{line}"' for line in rows_of(HEIGHTS, '","', ",")]), HEIGHTS)


def test_a_delimiter_at_the_end_of_each_line_separates_nothing(tmp_path: Path) -> None:
    check(read(tmp_path, ["a;b;c;d;e;f;g;", *(f"{line};" for line in rows_of(HEIGHTS, ";"))]), HEIGHTS)


HEADING = f"NCOLS {COLS}\nnRows {ROWS}\nxllcenter 5\nYLLCENTER\t6\nCellSize 0.5\n"


@pytest.mark.parametrize("width", [1, 5, COLS, 1000])
@pytest.mark.parametrize("sizes", ["", "dx 0.5\ndy 0.5\n"])
def test_an_esri_grid_may_end_its_lines_anywhere(tmp_path: Path, width: int, sizes: str) -> None:
    holed = np.where(HEIGHTS > 0.7, NAN, HEIGHTS)
    cells = [f"{height:g}".replace("nan", "-9999") for height in holed.flat]
    lines = [" ".join(cells[start : start + width]) for start in range(0, len(cells), width)]
    samples = read(tmp_path, f"\n{HEADING}{sizes}" + "\n ".join(lines), ".asc")
    check(samples, holed)
    assert not samples.lengths and samples.unit_mm is None
    check(
        read(tmp_path, f"{HEADING}nodata_VALUE -1\n" + "\n".join(lines), ".asc"),
        np.nan_to_num(holed, nan=-9999),
    )
    for wrong in (cells[:-1], [*cells, "1"]):
        assert f"{COLS} x {ROWS} numbers; the file" in refusal(tmp_path, HEADING + "\n".join(wrong), ".asc")


def test_what_is_no_grid_takes_one_line(tmp_path: Path) -> None:
    assert "profile" in refusal(tmp_path, "1\n2\n3\n" * 50)
    assert "profile" in refusal(tmp_path, "x;h\n" + "1,5;2\n" * 50)
    assert "points x, y, z" in refusal(tmp_path, "x y z\n" + "1 2 3\n" * 50, ".txt")
    for nothing in (
        "",
        "\n\n",
        "# only\n",
        "a letter\nto somebody\n",
        "nan,nan,nan,nan\n" * 4,
        b"\xff\xfe1",
        "ncols 4\n",
    ):
        refusal(tmp_path, nothing)
    for damaged in (
        "1,2,3,4\n1,2,3\n",
        "1,2,3,4\n1,2,3.4.5,6\n",
        '1,2,3,"4\n1,2,3,4\n',
        "ncols nan\nnrows 1e999\n1",
    ):
        refusal(tmp_path, damaged)


@pytest.mark.parametrize(
    "hostile",
    [
        b",",
        b"1 ",
        b"- ",
        b'"',
        b'";',
        b"\t",
        b"a",
        b" ",
        b"#",
        b"1\n",
        b"nan,",
        b"1 -",
        b"dx 1\n",
        b"a\n",
        b"#A",
        b"\r",
    ],
)
def test_hostile_texts_take_little_time(tmp_path: Path, hostile: bytes) -> None:
    start = sum(os.times()[:2])
    many = hostile * (100_000 if b"\n" in hostile else 1_000_000)
    refusal(tmp_path, many)
    refusal(tmp_path, many + b"\n1,2,3,4\n1,2,3,x4")
    assert sum(os.times()[:2]) - start < 20.0


def test_thousands_of_columns(tmp_path: Path) -> None:
    wide = np.random.default_rng(1).integers(0, 99, (4, 20_000)).astype(float)
    check(read(tmp_path, rows_of(wide)), wide)
