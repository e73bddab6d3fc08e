"""Scenes, nets and renderers that the tests of fast pictures share."""

import hashlib
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from relief.relief import Relief
from surrogate.nets.unet import NetShape, UNet
from surrogate.nets.weights import ModelCard, save_net, weights_bytes
from tests.tactile.reliefs import waves
from tests.visual.scenes import sun
from visual import scene_looks
from visual.backend.user_settings import user_settings_kept
from visual.fast.ambient_net import CHANNELS, trained_ambient_light, validity
from visual.fast.bsdf_table import BsdfTable, ambient_table
from visual.fast.renderer import FastRenderer
from visual.scene import Scene
from visual.scene_file.check import check_scene
from visual.scene_looks import FastLook

STUDIO = Path(__file__).resolve().parents[3] / "mitsuba_scenes" / "studio.xml"
SIDE = 32
"""Height samples a side."""


@pytest.fixture(scope="module")
def scene(mi_module: ModuleType) -> Scene:
    return Scene(
        check_scene(STUDIO, {"resolution": str(SIDE)}), Relief(np.zeros((SIDE, SIDE))), "llvm_ad_mono"
    )


@pytest.fixture(scope="module")
def mi_module() -> ModuleType:
    from visual.backend import variants

    return variants.load_mitsuba(colour=False, variant="llvm_ad_mono")


@pytest.fixture(scope="module")
def ambient(scene: Scene) -> BsdfTable:
    """The studio's material under a sky of radiance 1."""
    with user_settings_kept:
        return ambient_table(scene.light_scenes()[0].bsdf, np.ones(3))


@pytest.fixture(scope="module")
def neutral_net(ambient: BsdfTable, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a net that corrects nothing, for the studio's material."""
    net = UNet(NetShape(CHANNELS, 1, (4, 4), 2))
    valid = validity(ambient, SIDE)
    digest = hashlib.sha256(weights_bytes(net)).hexdigest()
    path = tmp_path_factory.mktemp("weights")
    save_net(path, net, ModelCard("look", net.shape, digest, valid, {}, {}, {}, {}, ()))
    return path


@pytest.fixture
def with_net(neutral_net: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        scene_looks, "trained_ambient_light", partial(trained_ambient_light, folder=neutral_net)
    )


@pytest.fixture
def two_lights(scene_of: Callable[..., Scene]) -> FastRenderer:
    """A renderer of two parallel lights without ambient light."""
    lights = (sun(35.0, 20.0), sun(50.0, 145.0))
    return FastLook(scene_of(*lights, heights=waves(SIDE, 1.5).numpy())).renderer
