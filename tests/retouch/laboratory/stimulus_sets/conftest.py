"""The small set that tests share: a tile of 32 x 32 samples, one rougher, one colder, one scaled."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from relief.heightmap import save_heights_exr
from retouch.laboratory.stimulus_sets.making import make
from retouch.laboratory.stimulus_sets.stimulus_set import StimulusSet
from tests.retouch.laboratory.studies.conftest import in_process

SAMPLES = 32


def request(texture: Path, **changed: object) -> StimulusSet:
    """A set of few samples, verified by the elastic layer."""
    settings = {"verify.model": "layer", "verify.samples": 4, "define.resolution": str(SAMPLES)}
    settings |= {"touch.model": "quick", "look.model": "fast", "touch.spacing_mm": 5.0}
    return StimulusSet.model_validate(
        {"textures": [texture], "settings": settings, "jnd": (0.0, 1.0)} | changed
    )


@pytest.fixture(scope="session")
def tile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Hills 5 and 3.3 mm apart that repeat."""
    y, x = np.meshgrid(*[2.0 * np.pi * np.arange(SAMPLES) / SAMPLES] * 2, indexing="ij")
    waves = np.sin(2.0 * x + y) + 0.6 * np.cos(3.0 * y - x)
    path = tmp_path_factory.mktemp("tile") / "hills-tile.exr"
    save_heights_exr(path, 0.25 * (waves - waves.min()), 10.0)
    return path


@pytest.fixture(scope="session")
def stimuli(tile: Path) -> StimulusSet:
    return request(tile, contact_area_scale=(1.1,), same_roughness=True, with_scaled=True)


@pytest.fixture(scope="session")
def whole(stimuli: StimulusSet, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the finished set."""
    out = tmp_path_factory.mktemp("stimuli") / "hills"
    made = make(stimuli, out, in_process)
    assert not made.content["failures"] and not made.missing
    return out


@pytest.fixture
def copy(whole: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(whole, tmp_path / "copy"))
