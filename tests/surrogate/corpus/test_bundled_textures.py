"""The example textures are what their command makes."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from surrogate.corpus import bundled_textures as textures


@pytest.mark.parametrize("name", textures.CROPS)
def test_the_committed_texture_is_what_the_command_makes(name: str) -> None:
    committed = np.asarray(Image.open(textures.FOLDER / f"{name}.png"))
    made = textures.make(name)
    assert committed.dtype == np.uint16
    assert committed.shape == (textures.SIDE, textures.SIDE)
    # One step of 65535: the last bit of a sum may differ between machines.
    assert np.abs(committed.astype(int) - made.astype(int)).max() <= 1


def test_writing_leaves_nothing_but_the_textures(tmp_path: Path) -> None:
    paths = textures.write_all(tmp_path / "new")
    assert sorted(paths) == sorted((tmp_path / "new").iterdir())


def test_a_texture_uses_its_whole_range_and_more_levels_than_8_bits_have() -> None:
    for name in textures.CROPS:
        grey = textures.make(name)
        assert grey.min() == 0
        assert grey.max() == 65535
        assert len(np.unique(grey)) > 256


def test_shrinking_keeps_a_ramp_a_ramp() -> None:
    photograph = np.tile(np.arange(64.0), (64, 1))
    relief = textures.relief_from_photograph(photograph)
    assert relief.shape == (32, 32)
    inner = np.diff(relief[:, 4:-4], axis=1)
    np.testing.assert_allclose(inner, inner[0, 0])
