"""A picture becomes the height map that was asked for, and everything that was done is told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image
from PIL.PngImagePlugin import PngInfo
from scipy.ndimage import gaussian_filter

from relief.corrections import levelled
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import load_height_map, save_heights_exr, save_heights_png
from relief.preparing.picture_preparation import prepare
from relief.preparing.resampling import grey_values
from relief.reading.samples import TILE_MARKS, Samples
from relief.relief import Relief

SIDE = 32


@pytest.fixture
def hills() -> Array:
    """Smooth bumps, (40, 40), from 0 to 1."""
    y, x = np.mgrid[:40, :40] / 40
    heights = np.sin(7 * x) * np.cos(5 * y)
    return (heights - heights.min()) / np.ptp(heights)


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
    assert f"{told['pixels']:.0f} x {told['pixels']:.0f} of the square's 40 x 40" in prepared.done["tile"]
    assert {"blend", "cut"} == told["seam_errors"].keys()


def test_a_tile_tells_what_part_of_the_square_it_repeats_and_how_it_magnifies_it(tmp_path: Path) -> None:
    y, x = np.mgrid[:200, :200] / 200
    weave = np.where(
        (np.floor(10 * x) + np.floor(10 * y)) % 2, np.sin(10 * np.pi * x), np.sin(10 * np.pi * y)
    )
    weave = np.abs(weave) + 0.5 * x + 0.3 * y**2
    Image.fromarray((255 * weave / weave.max()).astype(np.uint8)).save(tmp_path / "weave.png")
    corners = set()
    for rotate in (0, 90, 180, 270):
        prepared = prepare(tmp_path / "weave.png", centre=180, tile="cut", rotate=rotate, samples=SIDE)
        assert prepared.square == (10, 10, 190, 190) and prepared.tile_square is not None
        left, upper, right, lower = prepared.tile_square
        side = prepared.numbers["tile"]["pixels"]
        assert right - left == lower - upper == round(side) < 150
        assert f"{180 / round(side):.3g} times as large" in prepared.done["scale"]
        assert f"--size-mm {round(side) / 18:.3g} " in prepared.done["scale"]
        corners.add((left == 10, upper == 10))
        # Far from the joint at the upper and left border the tile is that part of the picture.
        part = np.asarray(Image.open(tmp_path / "weave.png"), float)[upper:lower, left:right]
        turned = np.rot90(part, rotate // 90)
        shrunk = np.asarray(Image.fromarray(turned).resize((SIDE, SIDE), Image.Resampling.BILINEAR))
        middle = slice(SIDE // 2, -2)
        fit = np.corrcoef(shrunk[middle, middle].ravel(), prepared.heights[middle, middle].ravel())[0, 1]
        assert fit > 0.95
    assert len(corners) == 4
    whole = prepare(tmp_path / "weave.png", samples=SIDE)
    assert whole.tile_square is None and "scale" not in whole.done


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


def test_the_ends_are_the_pixels_of_the_part_that_is_taken(tmp_path: Path) -> None:
    """A map of known scale is stretched by one factor, which is reported, at any number of samples."""
    rng = np.random.default_rng(0)
    grey = np.rint(20 + 200 * rng.random((96, 96))).astype(np.uint8)
    grey[40:60, 40:60] = np.rint(60 + 60 * rng.random((20, 20))).astype(np.uint8)
    Image.fromarray(grey).save(tmp_path / "a.png")
    options: dict[str, Any] = {"relief_mm": 0.6, "keep_steps": True}
    for samples in (24, 96):
        stretched = prepare(tmp_path / "a.png", samples=samples, **options)
        known = prepare(tmp_path / "a.png", samples=samples, levels="0,255", **options)
        low, high = grey.min(), grey.max()
        np.testing.assert_allclose(
            stretched.heights, (known.heights - 0.6 * low / 255) * 255 / (high - low), atol=1e-5
        )
        assert f"darkest pixel {low}, brightest {high} of 255: stretched 1.2" in stretched.done["levels"]
        assert "-fold; --levels 0,255 keeps the picture's own scale" in stretched.done["levels"]
    part = prepare(tmp_path / "a.png", crop=(40, 40, 20, 20), **options)
    assert f"darkest pixel {grey[40:60, 40:60].min()}, " in part.done["levels"]
    half = prepare(tmp_path / "a.png", levels="50%,100%", samples=24, **options)
    assert half.numbers["levels"]["lowest"] == pytest.approx(np.median(grey), abs=1)
    assert "percentiles of the pixels that are taken" in half.done["levels"]


def test_numbers_times_a_scale_are_heights_above_the_lowest(tmp_path: Path, hills: Array) -> None:
    micrometres = 250 * (hills - 0.5)
    np.save(tmp_path / "a.npy", micrometres)
    with pytest.raises(InputError, match="the numbers span 250, more than 3 if they are mm; are these um"):
        prepare(tmp_path / "a.npy")
    options: dict[str, Any]
    for options in ({"units": "um"}, {"height_scale": 1e-3}):
        prepared = prepare(tmp_path / "a.npy", **options)
        np.testing.assert_allclose(prepared.heights, 0.25 * hills, atol=1e-7)
        assert prepared.relief_mm == pytest.approx(0.25)
    lifted = prepare(tmp_path / "a.npy", units="um", levels="-100,50")
    np.testing.assert_allclose(lifted.heights, np.clip(micrometres, -100, 50) / 1000 + 0.1, atol=1e-7)
    np.save(tmp_path / "a.npy", 250e-6 * hills)
    assert "are these m, 0.25 mm? --units m" in prepare(tmp_path / "a.npy").done["unit"]
    for options, word in (
        ({"units": "um", "height_scale": 1e-3}, "units: is another scale than height_scale"),
        ({"units": "um", "relief_mm": 1.0}, "relief_mm: units or height_scale state"),
        ({"units": "ell"}, "units: 'ell' is not one of um, mm"),
        ({"height_scale": 0.0}, r"height_scale: 0 is outside \[1e-06"),
        (
            {"units": "m", "height_scale": None, "levels": "0,1"},
            "a.npy: 1000 mm high; the highest allowed is 20; are these mm[?] units='mm'",
        ),
    ):
        with pytest.raises(InputError, match=word):
            prepare(tmp_path / "a.npy", **options)


def test_a_picture_of_grey_has_no_unit(stone: Path) -> None:
    with pytest.raises(InputError, match="a picture is scaled by relief_mm") as caught:
        prepare(stone, units="um")
    assert caught.value.for_command.endswith("as --units is; a picture is scaled by --relief-mm")


def test_what_was_not_measured_is_filled_or_refused(tmp_path: Path, hills: Array) -> None:
    """The rest of an elevation model, whose hole is a number, has the whole relief."""
    elevations = (300 + 700 * hills).astype(np.float32)
    elevations[4:8, 10:20] = -9999.0
    np.save(tmp_path / "a.npy", elevations)
    with pytest.raises(InputError, match=r"2\.5 % of the part that is taken were not measured") as caught:
        prepare(tmp_path / "a.npy", relief_mm=1.2)
    assert "--fill fills them from around, --crop takes another part" in caught.value.for_command
    filled = prepare(tmp_path / "a.npy", relief_mm=1.2, fill=True)
    measured = elevations > 0
    np.testing.assert_allclose(filled.heights[measured], 1.2 * hills[measured], atol=1e-5)
    rim = filled.heights[3:9, 9:21][measured[3:9, 9:21]]
    assert rim.min() <= filled.heights[~measured].min() < filled.heights[~measured].max() <= rim.max()
    assert filled.numbers["holes_percent"] == pytest.approx(2.5)
    assert prepare(tmp_path / "a.npy", relief_mm=1.2, crop=(0, 8, 32, 32)).numbers["holes_percent"] == 0.0


@pytest.mark.parametrize("samples", [40, 20])
def test_a_tilt_is_reported_and_taken_out(tmp_path: Path, hills: Array, samples: int) -> None:
    row, col = np.indices(hills.shape)
    relief = 0.04 * levelled(hills)
    np.save(tmp_path / "a.npy", 2.0 + relief + (0.3 * col + 0.1 * row) / len(hills))
    tilted = prepare(tmp_path / "a.npy", size_mm=10.0)
    assert tilted.done["tilt"].startswith("0.3 mm along x and -0.1 mm along y, 2.")
    assert tilted.done["tilt"].endswith("in the middle; --level takes it out")
    tilted = prepare(tmp_path / "a.npy", size_mm=10.0, level=True, samples=samples)
    np.save(tmp_path / "b.npy", relief)
    np.testing.assert_allclose(
        tilted.heights, prepare(tmp_path / "b.npy", size_mm=10.0, samples=samples).heights, atol=1e-6
    )


def test_a_texture_that_repeats_stays_whole_and_has_means_around_its_border(tmp_path: Path) -> None:
    """Samples do not depend on where the tile begins, also where the header alone says that it repeats."""
    rng = np.random.default_rng(0)
    texture = gaussian_filter(rng.random((256, 256)), 5.0, mode="wrap")
    texture = np.rint(65535 * (texture - texture.min()) / np.ptp(texture)).astype(np.uint16)
    for name, turned in (("a", texture), ("b", np.roll(texture, (128, 64), (0, 1)))):
        Image.fromarray(turned).save(tmp_path / f"{name}.png")
        mark = PngInfo()
        mark.add_text("retouch.repeats", "xy")
        Image.fromarray(turned).save(tmp_path / f"{name}-marked.png", pnginfo=mark)
    for kind, tile in (("", "auto"), ("-marked", None), ("-marked", "auto")):
        one, other = (
            prepare(tmp_path / f"{name}{kind}.png", samples=64, relief_mm=0.6, tile=tile) for name in "ab"
        )
        np.testing.assert_allclose(np.roll(one.heights, (32, 16), (0, 1)), other.heights, atol=1e-6)
        assert one.repeats and one.done["samples"].endswith("around the border")
    assert other.numbers["tile"]["pixels"] == 256 and other.done["tile"].startswith("as it is")
    joined = prepare(tmp_path / "a.png", samples=64, relief_mm=0.6, tile="blend")
    assert joined.numbers["tile"]["method"] == "blend"


def test_a_small_tile_names_the_side_that_is_needed(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    for side, word in ((16, "tile: a tile of 16 pixels a side needs a picture of at least 20"), (20, "")):
        grey = gaussian_filter(rng.random((side, side)), 2.0) * np.linspace(1.0, 2.0, side)
        Image.fromarray(np.rint(120 * grey / grey.max()).astype(np.uint8)).save(tmp_path / "a.png")
        if word:
            with pytest.raises(InputError, match=word):
                prepare(tmp_path / "a.png", tile="auto")
        else:
            assert prepare(tmp_path / "a.png", tile="blend").heights.shape == (16, 16)


def test_a_height_that_no_option_gave_is_not_blamed_on_one(tmp_path: Path, hills: Array) -> None:
    np.save(tmp_path / "a.npy", np.rint(400 * hills).astype(np.int64))
    with pytest.raises(InputError) as caught:
        prepare(tmp_path / "a.npy", units="mm")
    line = f"{tmp_path / 'a.npy'}: 400 mm high; the highest allowed is 20; are these um? --units um"
    assert caught.value.for_command == line
    with pytest.raises(InputError, match="relief_mm: 25 is above 20"):
        prepare(tmp_path / "a.npy", relief_mm=25.0)


@pytest.mark.parametrize("kind", ["xy", "x", "y"])
@pytest.mark.parametrize("rotate", [0, 90])
@pytest.mark.parametrize("samples", [64, 48])
def test_a_tile_is_not_tilted_along_the_axes_that_repeat(
    tmp_path: Path, kind: str, rotate: int, samples: int
) -> None:
    """A saw tooth in x and in y, whose nearest plane would have a slope, and a tilt along what is left."""
    saw = np.interp(np.arange(64.0), [0, 50, 64], [0.0, 1.0, 0.0])
    y, x = np.indices((64, 64)) / 64
    tilt = 0.3 * y * (kind == "x") + 0.3 * x * (kind == "y")
    flat, repeats = 0.2 * (saw + saw[:, None]), TILE_MARKS[kind]
    save_heights_exr(tmp_path / "a.exr", flat + tilt, repeats=repeats)
    options: dict[str, Any] = {"rotate": rotate, "samples": samples}
    prepared = prepare(tmp_path / "a.exr", level=True, **options)
    turned = {"x": "y", "y": "x"}.get(kind, True) if rotate else repeats
    assert prepared.repeats == turned and ("tilt" in prepared.done) == (kind != "xy")
    if kind == "xy":
        plain = prepare(tmp_path / "a.exr", **options)
        assert "tilt" not in plain.done and prepared.done == plain.done
        np.testing.assert_array_equal(prepared.heights, plain.heights)
    else:
        axis = "y" if prepared.repeats == "x" else "x"
        tilts = prepared.numbers["tilt"]
        assert tilts["xy".replace(axis, "")] == 0.0 and abs(tilts[axis]) > 0.3
    prepared.save(tmp_path / "b.png")
    assert Relief.read(tmp_path / "b.png").repeats == (
        prepared.repeats in (True, "y"),
        prepared.repeats in (True, "x"),
    )


def test_a_part_of_a_tile_and_sides_that_do_not_fit_are_no_tile(tmp_path: Path, hills: Array) -> None:
    save_heights_exr(tmp_path / "a.exr", hills, repeats=True)
    prepared = prepare(tmp_path / "a.exr")
    assert prepared.repeats is False and "tilt" in prepared.done
    assert "is not followed: the sides do not fit along" in prepared.done["header"]
    row, col = np.indices((40, 60)) / 20
    waves = np.sin(2 * np.pi * row) + np.sin(2 * np.pi * col)
    save_heights_exr(tmp_path / "a.exr", 1.0 + 0.2 * waves, repeats=True)
    assert prepare(tmp_path / "a.exr").repeats == "y"
    assert prepare(tmp_path / "a.exr", centre=30).repeats is False


def test_holes_of_a_tile_are_filled_across_its_border(tmp_path: Path) -> None:
    ramp = np.interp(np.arange(64.0), [0, 32, 64], [1.0, 0.0, 1.0])
    heights = np.repeat(ramp[None], 64, axis=0)
    heights[:, :4] = heights[:, -8:] = np.nan
    save_heights_exr(tmp_path / "a.exr", heights, repeats="x")
    prepared = prepare(tmp_path / "a.exr", fill=True)
    assert prepared.repeats == "x"
    # Twelve samples between rims of 1 - 4 / 32 and 1 - 9 / 32 of the height; the lowest became 0.
    between = 1.0 - np.interp(np.arange(14), [0, 13], [9 / 32, 4 / 32])
    np.testing.assert_allclose(
        np.roll(prepared.heights, 9, axis=1)[:, :14], between[None] * np.ones((64, 1)), atol=1e-6
    )


@pytest.mark.parametrize("options", [{}, {"level": True}, {"keep_steps": True}])
def test_digits_far_from_zero_are_kept(tmp_path: Path, hills: Array, options: dict[str, Any]) -> None:
    """Of numbers, 0.4 mm at 1000 km, and of 32 bits, 400 of 4e9."""
    size = 0.4 * hills
    np.save(tmp_path / "near.npy", size)
    np.save(tmp_path / "a.npy", 1e6 + size)
    near, far = (prepare(tmp_path / name, **options) for name in ("near.npy", "a.npy"))
    np.testing.assert_allclose(far.heights, near.heights, atol=1e-6)
    if not options.get("level"):
        assert far.done["levels"] == "1000000 is lowest, 1000000.4 highest"
        assert far.numbers["levels"]["highest"] == pytest.approx(1e6 + 0.4, abs=1e-8)
        cut = prepare(tmp_path / "a.npy", levels="1000000.1,1000000.3", **options)
        np.testing.assert_allclose(cut.heights, np.clip(size, 0.1, 0.3) - 0.1, atol=1e-6)
    assert far.numbers["tilt"]["middle"] == pytest.approx(1e6 + near.numbers["tilt"]["middle"])
    whole = np.rint(1e5 * hills).astype(np.uint32)
    tifffile.imwrite(tmp_path / "a.tif", 2**31 + whole, photometric="minisblack")
    tifffile.imwrite(tmp_path / "near.tif", whole, photometric="minisblack")
    near, far = (prepare(tmp_path / f"{name}.tif", relief_mm=1.0, **options) for name in ("near", "a"))
    np.testing.assert_allclose(far.heights, near.heights, atol=1e-6)
    np.testing.assert_allclose(far.numbers["levels"]["lowest"], 127.5, atol=0.1)


def test_a_picture_of_known_height_is_lifted_and_not_clipped(tmp_path: Path, hills: Array) -> None:
    col = np.indices(hills.shape)[1] / len(hills)
    relief = 0.04 * levelled(hills)
    np.save(tmp_path / "a.npy", relief + 0.3 * col)
    prepare(tmp_path / "a.npy", size_mm=10.0).save(tmp_path / "a.png")
    prepared = prepare(tmp_path / "a.png", level=True)
    assert "saturate" not in prepared.done["levels"] and "stretched" not in prepared.done["levels"]
    assert prepared.relief_mm == pytest.approx(np.ptp(relief), rel=1e-3)
    np.testing.assert_allclose(prepared.heights, relief - relief.min(), atol=1e-5)
    prepared.save(tmp_path / "b.png")
    np.testing.assert_allclose(load_height_map(tmp_path / "b.png").heights, prepared.heights, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_rounding_is_no_saturation(tmp_path: Path, seed: int) -> None:
    heights = np.random.default_rng(seed).random((64, 64)).astype(np.float32)
    np.save(tmp_path / "a.npy", heights + np.linspace(0.0, 2.0, 64, dtype=np.float32))
    prepared = prepare(tmp_path / "a.npy", level=True)
    assert "saturate" not in prepared.done["levels"]
    assert prepared.numbers["levels"]["saturated_percent"] == 0.0


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("options", [{}, {"fill": True}, {"fill": True, "level": True}])
def test_a_part_without_a_measurement_takes_one_line(tmp_path: Path, options: dict[str, Any]) -> None:
    heights = np.random.default_rng(0).random((64, 64))
    heights[:32, :32] = np.nan
    for name, crop in (("whole", None), ("corner", (0, 0, 32, 32))):
        np.save(tmp_path / f"{name}.npy", heights if crop else np.full_like(heights, np.nan))
        with pytest.raises(
            InputError, match=rf"{name}\.npy: nothing was measured in the part that is taken$"
        ):
            prepare(tmp_path / f"{name}.npy", crop=crop, **options)
    heights[:] = np.nan
    heights[0, 0], heights[1, 1] = 0.0, 1.0
    np.save(tmp_path / "whole.npy", heights)
    with pytest.raises(InputError, match=r"99\.9 % of the part that is taken were not measured"):
        prepare(tmp_path / "whole.npy")


def test_transparent_numbers_are_not_made_white(tmp_path: Path, hills: Array) -> None:
    numbers = Samples(tmp_path, "numbers", {"Y": 0.4 * hills, "A": np.full_like(hills, 0.5)})
    np.testing.assert_array_equal(grey_values(numbers, (0, 0, 40, 40), "luminance"), 0.4 * hills)
