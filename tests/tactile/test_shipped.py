"""Operators that come with Retouch: there for every named round finger, and what the code builds."""

import numpy as np
import pytest

from mitsuba_scenes.fingers import bundled_skins
from optimize.settings.skins import load_skin
from relief.ground.tensors import read_tensors
from tactile.elements.round_pad import KIND, SHIPPED, PadMesh, difference, is_built
from tactile.layer.free_sides import STORED

ROUND = [name for name in bundled_skins() if load_skin(name).shape == "round"]


@pytest.mark.parametrize("name", ROUND)
def test_named_fingers_are_built(name: str) -> None:
    skin = load_skin(name)
    assert skin.patch_mm is not None
    assert is_built(skin, skin.patch_mm)


def test_no_other_files_are_shipped() -> None:
    files = sorted(SHIPPED.glob("*"))
    assert len(files) == len(ROUND) and all(file.name.startswith(KIND) for file in files)
    assert sum(file.stat().st_size for file in files) < 20e6


@pytest.mark.slow
def test_what_is_shipped_is_what_the_code_builds() -> None:
    skin = load_skin("measured")
    assert skin.radii_mm is not None and skin.patch_mm is not None
    name, parity = "odd", STORED["odd"]
    built = difference(skin.at_unit_modulus(), skin.radii_mm, skin.patch_mm, PadMesh(), parity)
    found = [read_tensors(file) for file in SHIPPED.glob("*.safetensors")]
    layers = f'"layers": "{skin.at_unit_modulus().stack!r}"'
    (shipped,) = (arrays for arrays, text in found if layers in text and f'"size": {skin.patch_mm}' in text)
    # The operators themselves: patterns of one strength may come in any order and sign.
    operator = built["face"].T @ (built["signs"] * built["face"])
    face, signs = (shipped[f"{part}_{name}"].astype(float) for part in ("face", "signs"))
    np.testing.assert_allclose(face.T @ (signs * face), operator, atol=1e-4 * np.abs(operator).max())
