"""The preview shows what is in a relief, however steep it is."""

from pathlib import Path

import numpy as np
import pytest

from mitsuba_scenes import find_texture
from relief.heightmap import load_heights
from relief.preparing.picture_preparation import prepare
from relief.preparing.preview import ACCENT, BRIGHT, DARK, PANEL, _picture, _shaded


@pytest.mark.parametrize("texture", ["gravel", "knit"])
@pytest.mark.parametrize("relief_mm", [0.3, 3.0])
def test_a_relief_is_neither_black_nor_white(texture: str, relief_mm: float) -> None:
    heights = load_heights(find_texture(Path(texture)))
    grey = np.asarray(_shaded(heights * (relief_mm / heights.max()), 10.0), dtype=float).mean(axis=-1)
    level = (grey - np.mean(DARK)) / (np.mean(BRIGHT) - np.mean(DARK))
    assert np.mean(level < 0.15) < 0.1 and np.mean(level > 0.85) < 0.5
    assert 0.4 < level.mean() < 0.85


def test_the_thick_frame_is_around_what_the_tile_repeats() -> None:
    prepared = prepare(find_texture(Path("gravel")), tile="blend", samples=32)
    assert prepared.tile_square is not None
    marked = (np.asarray(_picture(prepared)) == ACCENT).all(axis=-1)
    middle = np.flatnonzero(marked[PANEL // 4])
    edge = round(PANEL * prepared.tile_square[2] / prepared.picture.width) - 1
    assert {edge, edge - 1, edge - 2} <= set(middle.tolist()) and edge < 0.9 * PANEL
