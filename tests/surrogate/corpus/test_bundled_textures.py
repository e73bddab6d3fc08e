"""The example textures are what their command makes."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.bundled import textures
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_height_map
from relief.preparing.tiling import OVERLAP
from relief.seam import seams
from surrogate.corpus.recipes import SAMPLES

ALL = {**textures.TEXTURES, **textures.TILES}


@pytest.mark.parametrize("name", ALL)
def test_the_committed_texture_is_what_the_command_makes(name: str) -> None:
    texture, committed = ALL[name], load_height_map(textures.FOLDER / f"{name}.png")
    assert committed.size_mm == PATCH_SIDE_MM
    made = texture.heights()
    assert committed.heights.shape == made.shape == (SAMPLES, SAMPLES)
    # One step of 65535, and half a step of rounding: the last bit of a sum may differ between machines.
    np.testing.assert_allclose(committed.heights, made, rtol=0, atol=1.6 / 65535 * texture.relief_mm)


def test_the_headers_of_tiles_say_that_they_repeat_and_those_of_squares_do_not() -> None:
    repeats = {name: load_height_map(textures.FOLDER / f"{name}.png").repeats for name in ALL}
    assert repeats == {name: name in textures.TILES for name in ALL}


def test_the_tiles_that_all_numbers_were_measured_on_stay_the_same_bit_for_bit() -> None:
    digest = hashlib.sha256()
    for name in textures.TILES:
        with Image.open(textures.FOLDER / f"{name}.png") as picture:
            digest.update(np.asarray(picture).astype("<u2").tobytes())
    assert digest.hexdigest().startswith("d4d33a0b5214a0bc")


def test_writing_leaves_nothing_but_the_textures(tmp_path: Path) -> None:
    paths = textures.write_all(tmp_path / "new")
    assert sorted(paths) == sorted((tmp_path / "new").iterdir())
    assert [path.stem for path in paths] == list(ALL)


@pytest.mark.parametrize("name", textures.TILES)
def test_a_tile_goes_on_across_its_borders_and_shows_the_photograph_inside(name: str) -> None:
    tile = ALL[name].heights()
    assert max(seams(tile)) < 1.0
    if isinstance(ALL[name], textures.Procedural):
        return
    square = ALL[name.removesuffix("-tile")].heights()
    inside = slice(round(SAMPLES * OVERLAP), -1)
    assert np.corrcoef(tile[inside, inside].ravel(), square[inside, inside].ravel())[0, 1] > 0.99


@pytest.mark.parametrize("name", ALL)
def test_a_texture_uses_its_whole_range_and_more_levels_than_8_bits_have(name: str) -> None:
    heights = ALL[name].heights()
    assert heights.min() == 0.0
    assert heights.max() == ALL[name].relief_mm
    assert len(np.unique(heights)) > 256


def test_no_net_has_seen_a_procedural_texture() -> None:
    made = [texture for texture in textures.TEXTURES.values() if isinstance(texture, textures.Procedural)]
    assert len(made) == 9
    assert {texture.recipe.split for texture in made} == {"test"}


def test_shrinking_keeps_a_ramp_a_ramp() -> None:
    photograph = np.tile(np.arange(64.0), (64, 1))
    relief = textures.stretched(textures.shrunk(photograph))
    assert relief.shape == (32, 32)
    inner = np.diff(relief[:, 4:-4], axis=1)
    np.testing.assert_allclose(inner, inner[0, 0])
