"""Tiles continue across their borders as they do inside, and keep the heights of their texture."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from mitsuba_scenes import find_texture
from relief.heightmap import load_field
from relief.preparing.choices import METHODS
from relief.preparing.tiling import OVERLAP, border_ratio, make_tile, period, repeats_already

SAMPLES = 64
WHOLE = round(SAMPLES * (1 + OVERLAP))


def sand(side: int = WHOLE) -> NDArray[np.float64]:
    """A stochastic texture: Gaussian noise of one scale."""
    return ndimage.gaussian_filter(np.random.default_rng(5).normal(size=(side, side)), 1.5)


def discs(side: int = WHOLE) -> NDArray[np.float64]:
    """A structured texture: flat discs on flat ground."""
    rng, (y, x) = np.random.default_rng(3), np.mgrid[:side, :side]
    heights = np.zeros((side, side))
    for row, col in rng.uniform(0, side, (14, 2)):
        heights[np.hypot(y - row, x - col) < 6] = 1.0
    return ndimage.gaussian_filter(heights, 0.7)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("texture", [sand, discs])
def test_the_border_is_as_smooth_as_the_inside(texture, method: str) -> None:
    heights = texture()
    tile = make_tile(heights, SAMPLES, method)
    assert tile.heights.shape == (SAMPLES, SAMPLES)
    assert tile.border_ratio == border_ratio(tile.heights) < 1.35
    assert border_ratio(heights[:SAMPLES, :SAMPLES]) > 1.6
    assert tile.histogram_change < 0.05


def test_a_light_gradient_leaves_no_wall() -> None:
    """Across the cut the heights follow the slopes of both copies, however far apart these are."""
    lit = sand() + np.linspace(0.0, 5.0 * sand().std(), WHOLE)
    assert border_ratio(lit[:SAMPLES, :SAMPLES]) > 5.0
    tile = make_tile(lit, SAMPLES, "cut")
    steps = np.abs(np.concatenate([np.diff(tile.heights, axis=axis, append=0)[:-1, :-1] for axis in (0, 1)]))
    own = np.abs(np.concatenate([np.diff(lit, axis=axis, append=0)[:-1, :-1] for axis in (0, 1)]))
    assert tile.border_ratio < 1.35
    assert steps.max() < 1.3 * own.max()


def test_blending_keeps_the_histogram() -> None:
    heights = np.exp(0.5 * sand() / sand().std())  # Heavy at one end, so that a plain mean would show.
    tile = make_tile(heights, SAMPLES, "blend")
    assert tile.histogram_change < 0.01
    np.testing.assert_allclose(tile.heights.std(), heights.std(), rtol=0.15)
    assert heights.min() <= tile.heights.min() and tile.heights.max() <= heights.max()


def test_the_method_with_the_smaller_seam_error_is_taken() -> None:
    for texture, method in ((sand(), "blend"), (discs(), "cut")):
        tile = make_tile(texture, SAMPLES)
        assert tile.method == method == min(tile.seam_errors, key=lambda name: tile.seam_errors[name])
        assert tile.seam_errors[method] < 0.8 * tile.seam_errors[tile.other]


def test_a_weave_repeats_by_its_own_period() -> None:
    y, x = (np.mgrid[:200, :200] + 0.5) / 200
    weave = np.abs(np.sin(7.3 * np.pi * x)) * np.abs(np.sin(7.3 * np.pi * y))
    side = period(weave)
    assert side < 1 / (1 + OVERLAP)
    assert side * 7.3 == pytest.approx(round(side * 7.3), abs=0.1)
    assert period(sand(200)) == 1 / (1 + OVERLAP)


def test_what_is_periodic_already_stays_so() -> None:
    angle = 2 * np.pi * np.arange(WHOLE) / SAMPLES
    heights = np.sin(3 * angle)[:, None] + np.cos(2 * angle)[None, :]
    tile = make_tile(heights, SAMPLES, "cut")
    np.testing.assert_allclose(tile.heights, heights[:SAMPLES, :SAMPLES], atol=1e-9)


@pytest.mark.parametrize("texture", [sand, discs])
@pytest.mark.parametrize("method", METHODS)
def test_a_tile_repeats_already_and_its_texture_does_not(texture, method: str) -> None:
    heights = texture()
    tile = make_tile(heights, SAMPLES, method).heights
    for turned in (tile, tile.T, np.roll(tile, (11, 23), (0, 1)), np.tile(tile, (2, 2))):
        assert repeats_already(turned)
    for part in (heights, heights[:SAMPLES, :SAMPLES], tile[:, : SAMPLES // 2], tile[: SAMPLES // 3]):
        assert not repeats_already(part)


@pytest.mark.parametrize(
    "name",
    [
        *("bark", "brick", "dots", "grass", "gravel", "knit", "leather", "pebbles", "scratches", "terrain"),
        *("waves", "weave"),
    ],
)
def test_bundled_tiles_repeat_already_and_textures_do_not(name: str) -> None:
    assert repeats_already(load_field(find_texture(Path(f"{name}-tile"))))
    assert not repeats_already(load_field(find_texture(Path(name))))


@pytest.mark.parametrize("name", ["brick", "camera", "coins", "grass", "gravel", "moon", "page", "text"])
def test_photographs_do_not_repeat_already(name: str) -> None:
    with resources.as_file(resources.files("skimage") / "data" / f"{name}.png") as file:
        picture = load_field(file)
    side = min(picture.shape)
    for part in (
        picture[:side, :side],
        picture[: side // 2, : side // 2],
        picture[-side // 3 :, -side // 3 :],
    ):
        assert not repeats_already(part)
