"""A tile repeats over a plate of any size at its own pitch; what is no tile is refused."""

from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.ground.limits import LARGEST_SIDE
from relief.heightmap import load_height_map, save_heights_exr
from relief.preparing.picture_preparation import prepare
from relief.preparing.tiling import repeated

SIDE = 40
ANGLE = 2 * np.pi * np.arange(SIDE) / SIDE
TILE = 0.5 + 0.25 * np.sin(3 * ANGLE)[:, None] + 0.25 * np.cos(2 * ANGLE)


def test_a_plate_goes_on_with_the_first_row_and_column_again() -> None:
    plate = repeated(TILE, 8.0, 20.0)
    assert (plate.heights.shape, plate.size_mm) == ((100, 100), 20.0)
    np.testing.assert_array_equal(plate.heights[:80, :80], np.tile(TILE, (2, 2)))
    np.testing.assert_array_equal(plate.heights[80:, 80:], TILE[:20, :20])


def test_a_plate_has_whole_samples_of_the_pitch_of_the_tile() -> None:
    plate = repeated(TILE, 8.0, 20.09)
    assert (len(plate.heights), plate.size_mm) == (100, 20.0)
    assert (plate.tile_mm, plate.tile_samples) == (8.0, SIDE)


@pytest.mark.parametrize("plate_mm", [7.9, 8.0 * LARGEST_SIDE / SIDE + 1, float("nan"), float("inf"), -1.0])
def test_a_plate_is_no_smaller_than_its_tile_nor_too_large(plate_mm: float) -> None:
    with pytest.raises(InputError, match=r"plate_mm: .* from 8, the side of the tile, to 819\.2"):
        repeated(TILE, 8.0, plate_mm)


def test_what_is_no_tile_is_refused_with_the_option_that_makes_one() -> None:
    with pytest.raises(InputError, match=r"plate_mm: the sides do not fit along y.*tile='auto'") as caught:
        repeated(np.cumsum(TILE, axis=0), 8.0, 20.0)
    assert caught.value.for_command.endswith("make it periodic with --tile")


def test_a_part_of_a_file_with_a_header_keeps_its_scale(tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "stone.exr", np.tile(TILE, (2, 2)), 16.0)
    assert prepare(tmp_path / "stone.exr").size_mm == 16.0
    assert prepare(tmp_path / "stone.exr", centre=SIDE).size_mm == 8.0
    assert prepare(tmp_path / "stone.exr", centre=SIDE, size_mm=10.0).size_mm == 10.0
    tile = prepare(tmp_path / "stone.exr", tile="auto")
    assert tile.size_mm == pytest.approx(16.0 * tile.numbers["tile"]["pixels"] / (2 * SIDE))


def test_a_tile_is_prepared_and_repeated_at_once_or_in_turn(tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "stone.exr", TILE + np.linspace(0, 1, SIDE), 10.0)
    at_once = prepare(tmp_path / "stone.exr", tile="cut", samples=32, plate_mm=25.0)
    assert at_once.done["plate"].startswith(f"{len(at_once.heights)} x {len(at_once.heights)} samples over")
    assert at_once.size_mm == pytest.approx(25.0, abs=0.13)
    tile = prepare(tmp_path / "stone.exr", tile="cut", samples=32)
    tile.save(tmp_path / "tile.exr")
    in_turn = prepare(tmp_path / "tile.exr", plate_mm=25.0)
    assert in_turn.size_mm == pytest.approx(at_once.size_mm)
    # The ends are those of the pixels, which the means of a tile do not reach; its lowest becomes 0 in turn.
    np.testing.assert_allclose(in_turn.heights, at_once.heights - at_once.heights.min(), atol=1e-6)
    in_turn.save(tmp_path / "plate.exr")
    assert load_height_map(tmp_path / "plate.exr").size_mm == pytest.approx(at_once.size_mm)
    with pytest.raises(InputError, match=r"stone\.exr: plate_mm: the sides do not fit"):
        prepare(tmp_path / "stone.exr", plate_mm=25.0)
