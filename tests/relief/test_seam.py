"""Seams tell a tile from a height map that does not repeat."""

import numpy as np
import pytest

from mitsuba_scenes import FOLDER
from relief.ground.errors import InputError
from relief.heightmap import load_heights
from relief.preparing.picture_preparation import prepare
from relief.seam import LARGEST_SEAM, check_seams, seams

TEXTURES = sorted((FOLDER / "textures").glob("*.png"))
UNDECIDED = "dots"
"""The bundled texture whose border cuts its dots no more sharply than they are."""
ANGLE = 2 * np.pi * np.arange(64) / 64


def test_a_tile_has_the_steps_of_its_inside_and_a_ramp_a_wall() -> None:
    down, right = seams(np.cos(ANGLE)[:, None] + np.arange(64.0))
    assert down < 1.0
    assert right == pytest.approx(63.0)


def test_a_plain_fits_and_a_wall_around_a_plain_does_not() -> None:
    assert seams(np.ones((16, 16))) == (0.0, 0.0)
    # Within a row nothing changes, from the first row to the last all does.
    assert seams(np.repeat([[0.0], [1.0]], 16, axis=1)) == (1.0, 0.0)


def test_a_height_map_rolled_by_any_number_of_rows_stays_a_tile() -> None:
    rng = np.random.default_rng(2)
    tile = np.cos(3 * ANGLE)[:, None] * np.cos(2 * ANGLE) + 0.05 * rng.standard_normal((64, 64))
    for shift in range(64):
        assert max(seams(np.roll(tile, (shift, -shift), (0, 1)))) < LARGEST_SEAM


@pytest.mark.parametrize("path", TEXTURES, ids=lambda path: path.stem)
def test_bundled_textures_are_no_tiles_unless_they_are_called_so(path) -> None:
    fits = max(seams(load_heights(path))) <= LARGEST_SEAM
    assert fits == (path.stem.endswith("-tile") or path.stem == UNDECIDED)


@pytest.mark.parametrize("name", ["gravel", "terrain"])
def test_bundled_textures_are_tiles_after_their_preparation(name: str) -> None:
    tile = prepare(FOLDER / "textures" / f"{name}.png", samples=64, tile="auto").heights
    assert max(seams(tile)) < 1.0


def test_only_axes_that_repeat_are_checked_and_the_line_says_what_to_do() -> None:
    heights = np.cos(ANGLE)[:, None] + np.arange(64.0) / 64
    check_seams(heights, (True, False), "stone.png")
    with pytest.raises(InputError, match=r"stone\.png: repeats: .* along x, .* 63\.0 times") as caught:
        check_seams(heights, (False, True), "stone.png")
    assert caught.value.for_command.endswith("retouch prepare stone.png -o stone-tile.png --tile")
    assert "retouch.prepare('stone.png', tile='auto').save('stone-tile.png')" in str(caught.value)
