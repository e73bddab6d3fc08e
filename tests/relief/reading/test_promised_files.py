"""Files of every kind that docs/reference/formats.md promises hold what was written into them."""

import logging
import subprocess
import sys
from pathlib import Path

import imagecodecs
import numpy as np
import OpenEXR
import pytest
import tifffile
from PIL import Image

from relief.ground.errors import InputError
from relief.heightmap import holds_mm, load_heights
from relief.reading.readers import read_samples
from tests.relief.reading.promised_files import Writer, promised, stored

FILES = [*promised()]


def test_three_hundred_files_are_promised() -> None:
    assert len(FILES) >= 300
    assert len({name for name, *_ in FILES}) == len(FILES)


@pytest.mark.parametrize(("name", "suffix", "write"), [pytest.param(*one, id=one[0]) for one in FILES])
def test_a_promised_file_is_read_right(tmp_path: Path, name: str, suffix: str, write: Writer) -> None:
    path = tmp_path / f"map{suffix}"
    truth = write(path)
    samples = read_samples(path)
    assert [*samples.channels] == ["Y"] and samples.count == 1
    values = samples.channels["Y"].astype(np.float64) / samples.white
    np.testing.assert_array_equal(np.isnan(values), np.isnan(truth))
    # PXR24 keeps 24 of the 32 bits of numbers.
    np.testing.assert_allclose(values, truth, rtol=2e-5 if "PXR24" in name else 1e-6, atol=1e-7)


def test_what_is_not_promised_takes_one_line(tmp_path: Path) -> None:
    grey, numbers = stored("uint8"), stored("float32")
    complex_numbers = numbers + 1j * numbers
    tifffile.imwrite(tmp_path / "complex.tif", complex_numbers.astype(np.complex64))
    tifffile.imwrite(tmp_path / "volume.tif", np.stack([grey] * 16), volumetric=True, tile=(16, 16, 16))
    tifffile.imwrite(
        tmp_path / "bands.tif", np.stack([grey] * 2, -1), photometric="minisblack", planarconfig="contig"
    )
    tifffile.imwrite(tmp_path / "lab.tif", np.stack([grey] * 3, -1), photometric="cielab")
    tifffile.imwrite(tmp_path / "wide.tif", grey, resolution=(300, 150), resolutionunit=2)
    Image.fromarray(grey).save(tmp_path / "wide.png", dpi=(300, 150))
    Image.fromarray(grey).save(tmp_path / "wide.jpg", dpi=(300, 150))
    np.save(tmp_path / "complex.npy", complex_numbers)
    np.save(tmp_path / "truth.npy", grey > 9)
    np.save(tmp_path / "five.npy", np.stack([numbers] * 5, -1))
    header = {"type": OpenEXR.scanlineimage, "pixelAspectRatio": 2.0}
    OpenEXR.File(header, {"Y": numbers}).write(str(tmp_path / "wide.exr"))
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"u": numbers, "v": numbers}).write(
        str(tmp_path / "uv.exr")
    )
    (tmp_path / "points.csv").write_text("1,2,3\n" * 500)
    (tmp_path / "short.asc").write_text("ncols 5\nnrows 5\ncellsize 1\n" + "1 2 3 4 5\n" * 4)
    (tmp_path / "ragged.csv").write_text("1,2,3,4\n1,2,3\n")
    (tmp_path / "words.csv").write_text("this is a letter\nto somebody\n")
    (tmp_path / "nothing.csv").write_text("")
    files = sorted(tmp_path.iterdir())
    assert len(files) == 17
    read = []
    for file in files:
        try:
            read_samples(file)
            read.append(file)
        except InputError as error:
            line = str(error)
            assert line.startswith(str(file)) and "\n" not in line, line
    assert not read


@pytest.mark.parametrize("suffix", [".png", ".tif", ".exr", ".npy", ".csv"])
def test_content_states_the_kind_whatever_the_name(tmp_path: Path, suffix: str) -> None:
    grey, numbers = tmp_path / f"grey{suffix}", tmp_path / f"numbers{suffix}"
    Image.fromarray(stored("uint8")).save(grey, format="PNG")
    with numbers.open("wb") as file:
        np.save(file, stored("float32"))
    assert not holds_mm(grey) and holds_mm(numbers)
    np.testing.assert_allclose(load_heights(grey, relief_mm=1.0), stored("uint8") / 255.0)
    np.testing.assert_allclose(load_heights(numbers, height_scale=0.01), 0.01 * stored("float32"), rtol=1e-6)


def test_what_tifffile_logs_of_damage_is_dropped(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    logging.getLogger("tifffile").setLevel(logging.NOTSET)
    file = tmp_path / "cut.tif"
    tifffile.imwrite(file, stored("float32"), extratags=[(65000, "s", 0, "x" * 500, True)])
    content = bytearray(file.read_bytes())
    at = content.find(b"\xe8\xfd")  # The tag's offset points behind the end of the file.
    content[at + 8 : at + 12] = b"\xff\xff\xff\x7f"
    file.write_bytes(content)
    holds_mm(file)
    assert not caplog.records


def test_without_the_extra_a_line_names_it_where_it_is_needed(tmp_path: Path) -> None:
    """tifffile unpacks deflate by itself; a missing package takes a process of its own."""
    heights = stored("uint16")
    tifffile.imwrite(tmp_path / "deflate.tif", heights, compression="zlib", predictor=True)
    for compression in ("lzw", "zstd"):
        tifffile.imwrite(tmp_path / f"{compression}.tif", heights, compression=compression)
    (tmp_path / "colour.png").write_bytes(imagecodecs.png_encode(np.repeat(heights[..., None], 3, 2)))
    script = """
import sys
sys.modules["imagecodecs"] = None
from relief.ground.errors import InputError
from relief.heightmap import load_heights
for name in sys.argv[1:]:
    try:
        print(load_heights(name, relief_mm=1.0).shape)
    except InputError as error:
        print(error)
"""
    names = ["deflate.tif", "lzw.tif", "zstd.tif", "colour.png"]
    command = [sys.executable, "-c", script, *names]
    child = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    lines = [f"{name}: needs the extra images: pip install 'retouch[images]'" for name in names[1:]]
    assert child.stdout.splitlines() == [str(heights.shape), *lines]
