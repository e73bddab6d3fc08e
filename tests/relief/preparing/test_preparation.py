"""A picture becomes the height map that was asked for, and everything that was done is told."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from relief.ground.errors import InputError
from relief.heightmap import load_height_map, save_heights_png
from relief.preparing.picture_preparation import prepare
from relief.relief import Relief

SIDE = 32


@pytest.fixture
def stone(tmp_path: Path) -> Path:
    """A colour photograph, 48 x 40, of smooth bumps from grey 40 to 200."""
    y, x = np.mgrid[:40, :48] / 40
    grey = (120 + 80 * np.sin(7 * x) * np.cos(5 * y)).astype(np.uint8)
    Image.fromarray(np.stack([grey, grey + 3, grey], axis=-1)).save(tmp_path / "stone.png")
    return tmp_path / "stone.png"


def values(path: Path) -> NDArray[np.float64]:
    return np.asarray(Image.open(path).convert("RGB"), dtype=np.float64) @ [0.2126, 0.7152, 0.0722] / 255


def test_every_step_is_told(stone: Path) -> None:
    prepared = prepare(stone, relief_mm=1.2)
    assert prepared.heights.shape == (40, 40)
    assert (prepared.heights.min(), prepared.heights.max()) == (0.0, 1.2)
    assert [*prepared.done] == ["picture", "square", "grey", "samples", "steps", "levels", "relief"]
    assert prepared.done["picture"] == "48 x 40 pixels, PNG in colour, 8 bits"
    assert prepared.done["square"] == "40 x 40 pixels in the middle of the picture, from (4, 0)"
    assert prepared.done["samples"] == "40 x 40, one a pixel"
    assert prepared.numbers["steps"]["largest_change"] <= 0.5 * (1 + 1e-9)


@pytest.mark.parametrize("degrees", [90, 180, 270])
def test_a_turned_picture_has_turned_heights(stone: Path, degrees: int) -> None:
    as_taken, turned = (prepare(stone, keep_steps=True, relief_mm=1.0, rotate=each) for each in (0, degrees))
    np.testing.assert_allclose(turned.heights, np.rot90(as_taken.heights, degrees // 90), atol=1e-6)
    assert turned.done["turned"] == f"{degrees}° anticlockwise" and turned.square == as_taken.square


def test_a_picture_is_turned_by_quarters_only(stone: Path) -> None:
    with pytest.raises(InputError, match="rotate: '45' is not one of"):
        prepare(stone, rotate=45)


def test_heights_are_the_grey_of_the_square(stone: Path) -> None:
    prepared = prepare(stone, keep_steps=True, levels="0,255", relief_mm=2.0, crop=(6, 3, 20, 30), centre=18)
    np.testing.assert_allclose(prepared.heights, 2.0 * values(stone)[9:27, 7:25], atol=1e-6)
    dark = prepare(
        stone, keep_steps=True, levels="0,255", relief_mm=2.0, crop=(6, 3, 20, 30), centre=18, invert=True
    )
    np.testing.assert_allclose(dark.heights, 2.0 - prepared.heights, atol=1e-12)
    assert "steps" not in prepared.numbers and "terraces" in prepared.done["steps"]


def test_levels_are_values_or_percentiles(stone: Path) -> None:
    square = values(stone)[:, 4:44]
    for levels, (low, high) in {
        "80,160": (80 / 255, 160 / 255),
        "10%,90%": tuple(np.percentile(square, [10, 90])),
    }.items():
        prepared = prepare(stone, keep_steps=True, levels=levels)
        np.testing.assert_allclose(prepared.heights, np.clip((square - low) / (high - low), 0, 1), atol=1e-5)
        outside = prepared.numbers["levels"]["saturated_percent"]
        assert outside == pytest.approx(100 * np.mean((square < low) | (square > high)), abs=0.1)
        assert "saturate" in prepared.done["levels"]
    for levels in ("1", "a,b", "5,2", "0%,120%", "nan,3", "1,2,3", "10%,90"):
        with pytest.raises(InputError, match=r"stone\.png: levels: "):
            prepare(stone, levels=levels)


@pytest.mark.parametrize("suffix", ["png", "exr"])
def test_what_is_written_is_read_with_its_lengths(stone: Path, suffix: str) -> None:
    prepared = prepare(stone, samples=SIDE, relief_mm=1.2, size_mm=8.0)
    out = stone.with_name(f"heights.{suffix}")
    prepared.save(out)
    read = load_height_map(out)
    assert read.size_mm == 8.0
    np.testing.assert_allclose(read.heights, prepared.heights, atol=2e-5)


def test_without_a_relief_a_png_is_still_written(stone: Path) -> None:
    prepared = prepare(stone, samples=SIDE)
    assert prepared.relief_mm is None and "relief" not in prepared.done
    prepared.save(stone.with_name("heights.png"))
    read = load_height_map(stone.with_name("heights.png"), relief_mm=0.5)
    # Means over pixels do not reach the ends, which are the darkest and the brightest pixel.
    assert 0.0 < read.heights.min() < 0.01 < 0.49 < read.heights.max() < 0.5 and read.size_mm is None
    with pytest.raises(InputError, match="relief_mm: missing; an EXR holds mm"):
        prepared.save(stone.with_name("heights.exr"))
    with pytest.raises(InputError, match=r"written as \.png or \.exr"):
        prepared.save(stone.with_name("heights.jpg"))


def test_a_height_map_keeps_its_heights(tmp_path: Path) -> None:
    """A file of Retouch, cut or resampled, has the relief of its header; mm stay mm."""
    heights = 0.2 + 0.5 * np.random.default_rng(0).random((SIDE, SIDE))
    save_heights_png(tmp_path / "a.png", heights, 1.0, 10.0)
    again = prepare(tmp_path / "a.png")
    assert (again.relief_mm, again.size_mm) == (1.0, 10.0)
    np.testing.assert_allclose(again.heights, heights, atol=2e-5)
    np.save(tmp_path / "a.npy", heights)
    again = prepare(tmp_path / "a.npy")
    assert again.relief_mm == pytest.approx(np.ptp(heights), rel=1e-6)
    np.testing.assert_allclose(again.heights, heights - heights.min(), atol=1e-6)
    np.save(tmp_path / "a.npy", 1000 * heights)
    with pytest.raises(InputError, match=r"a\.npy: relief_mm: missing; the numbers span 499"):
        prepare(tmp_path / "a.npy")
    assert prepare(tmp_path / "a.npy", relief_mm=0.7).heights.max() == 0.7


def test_levels_beyond_black_and_white_are_called_so(tmp_path: Path) -> None:
    """More samples than pixels stay between black and white; the joints of a cut tile may go beyond."""
    row, col = np.indices((40, 40))
    Image.fromarray(np.where((row + 2 * col) % 14 < 7, 255, 0).astype(np.uint8)).save(tmp_path / "bars.png")
    finer = prepare(tmp_path / "bars.png", samples=64, keep_steps=True)
    assert finer.done["levels"] == "0 is lowest, 255 highest of 255"
    for levels in ("-20,240", "0,300"):
        told = prepare(tmp_path / "bars.png", levels=levels).done["levels"]
        assert "of 255" not in told and ", beyond the 0 to 255 of the picture" in told


def test_a_tile_stays_one(stone: Path) -> None:
    """The mark of a tile is written; what is made of the whole tile carries it on, a part of it does not."""
    tile, again = stone.with_name("tile.exr"), stone.with_name("again.png")
    prepare(stone, samples=SIDE, tile="cut", relief_mm=1.0).save(tile)
    assert Relief.read(tile).repeats == (True, True)
    for options, repeats in (
        ({"relief_mm": 0.5}, True),
        ({"crop": (0, 0, 24, 24)}, False),
        ({"plate_mm": 20.0}, True),
        ({"plate_mm": 25.0}, False),
    ):
        prepared = prepare(tile, **options)
        prepared.save(again)
        assert prepared.repeats == repeats and Relief.read(again).repeats == (repeats, repeats)


@pytest.mark.parametrize("method", ["auto", "blend", "cut"])
def test_a_tile_has_the_samples_that_were_asked_for(stone: Path, method: str) -> None:
    prepared = prepare(stone, samples=SIDE, tile=method, relief_mm=1.0)
    assert prepared.heights.shape == (SIDE, SIDE)
    assert 0.0 <= prepared.heights.min() < 0.1 and 0.9 < prepared.heights.max() <= 1.0
    told = prepared.numbers["tile"]
    assert told["method"] == method or method == "auto"
    assert told["pixels"] <= 40 / 1.25
    assert {"blend", "cut"} == told["seam_errors"].keys()


@pytest.mark.parametrize(
    ("option", "word"),
    [
        ({"grey": "puce"}, "grey: 'puce' is not one of luminance"),
        ({"grey": "alpha"}, "grey: alpha: the picture has no channel A"),
        ({"tile": "sew"}, "tile: 'sew' is not one of auto, blend, cut"),
        ({"samples": 15}, "samples: 15"),
        ({"samples": 4097}, "samples: 4097"),
        ({"centre": 41}, "centre: 41"),
        ({"centre": 15}, "at least 16 a side"),
        ({"crop": (0, 0, 49, 2)}, "crop: 0,0,49,2"),
        ({"relief_mm": 20.5}, "relief_mm: 20.5 is above 20"),
        ({"relief_mm": float("nan")}, "relief_mm: nan"),
        ({"size_mm": 0.0}, "size_mm: 0"),
    ],
)
def test_what_cannot_be_done_takes_one_line(stone: Path, option: dict[str, object], word: str) -> None:
    with pytest.raises(InputError) as caught:
        prepare(stone, **option)  # type: ignore[arg-type]
    assert str(caught.value).startswith(f"{stone}: {word}") or word in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_flat_picture_and_a_single_pixel_are_refused(tmp_path: Path) -> None:
    Image.fromarray(np.full((SIDE, SIDE), 77, np.uint8)).save(tmp_path / "flat.png")
    with pytest.raises(InputError, match=r"flat\.png: is flat"):
        prepare(tmp_path / "flat.png")
    Image.fromarray(np.full((1, 1), 77, np.uint8)).save(tmp_path / "dot.png")
    with pytest.raises(InputError, match=r"dot\.png: 1 x 1 pixels; at least 16"):
        prepare(tmp_path / "dot.png")
