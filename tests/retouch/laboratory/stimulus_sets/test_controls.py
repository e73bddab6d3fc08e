"""Controls: other patches of a picture become tiles of the texture's own scale and relief."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

from relief.ground.errors import InputError
from relief.heightmap import load_height_map
from relief.seam import misfit
from retouch.laboratory.stimulus_sets.controls import make_controls
from tests.retouch.laboratory.stimulus_sets.conftest import SAMPLES, request

WIDTH_MM = 40.0


@pytest.fixture
def wall(tmp_path: Path) -> Path:
    """A picture of 320 x 320 pixels, 40 mm wide."""
    noise = ndimage.gaussian_filter(np.random.default_rng(0).normal(size=(320, 320)), 4.0)
    grey = np.rint(255.0 * (noise - noise.min()) / np.ptp(noise)).astype(np.uint8)
    path = tmp_path / "wall.png"
    Image.fromarray(grey).save(path)
    return path


def test_patches_are_tiles_of_the_texture_s_scale_and_relief(wall: Path, tile: Path, tmp_path: Path) -> None:
    stimuli = request(tile, sources=(wall,), source_mm=WIDTH_MM)
    found = make_controls(stimuli, tmp_path / "set")
    assert [(one.texture, one.number) for one in found] == [("hills", 1), ("hills", 2), ("hills", 3)]
    patches = [load_height_map(one.file) for one in found]
    for patch in patches:
        assert patch.heights.shape == (SAMPLES, SAMPLES) and misfit(patch.heights) is None
        assert patch.side_mm == pytest.approx(10.0, rel=0.03)
        assert patch.heights.max() <= load_height_map(tile).heights.max() + 1e-6
    assert np.abs(patches[0].heights - patches[1].heights).max() > 0.1
    written = found[0].file.stat().st_mtime_ns
    assert make_controls(stimuli, tmp_path / "set") == found and found[0].file.stat().st_mtime_ns == written


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({}, "source_mm: missing; the picture does not say how many mm wide it is"),
        ({"source_mm": 20.0}, "holds 1 patches of 12.5 mm: tiles with seams; 3 controls are asked for"),
    ],
)
def test_sources_that_do_not_serve_are_refused(
    wall: Path, tile: Path, tmp_path: Path, changed: dict[str, float], told: str
) -> None:
    with pytest.raises(InputError, match=rf"wall\.png: {told}"):
        make_controls(request(tile, sources=(wall,), **changed), tmp_path / "set")
    assert not (tmp_path / "set").exists()
