"""The preview shows what is in a relief, however steep it is."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_scenes import find_texture
from relief.preparing.preparation import prepare
from relief.preparing.preview import BRIGHT, DARK, GAP, MARGIN, PANEL, preview


@pytest.mark.parametrize("texture", ["gravel", "knit"])
@pytest.mark.parametrize("relief_mm", [0.3, 3.0])
def test_a_relief_is_neither_black_nor_white(texture: str, relief_mm: float) -> None:
    sheet = Image.open(io.BytesIO(preview(prepare(find_texture(Path(texture)), relief_mm=relief_mm))))
    left, upper = MARGIN + 2 * (PANEL + GAP), MARGIN + 28
    grey = np.asarray(sheet.crop((left, upper, left + PANEL, upper + PANEL)), dtype=float).mean(axis=-1)
    level = (grey - np.mean(DARK)) / (np.mean(BRIGHT) - np.mean(DARK))
    assert np.mean(level < 0.15) < 0.1 and np.mean(level > 0.85) < 0.5
    assert 0.4 < level.mean() < 0.85
