"""Fingers that differ: the set about a skin, and its roughness against presses with every operator built."""

import numpy as np
import pytest

import tactile
from tactile.fingers import MOST_SAMPLES, fingers, roughness_by_finger
from tactile.skin import Skin

SKIN = Skin()


def bumps(samples: int, height_mm: float = 0.5) -> np.ndarray:
    """Bumps 2.5 mm apart of two heights, (samples, samples), mm."""
    x = 2.0 * np.pi * np.arange(samples) / samples
    grid = np.cos(4.0 * x)[:, None] + np.cos(4.0 * x)[None, :] + 0.5 * np.cos(x)[None, :]
    return np.asarray(height_mm * (grid - grid.min()) / np.ptp(grid))


def test_fingers_of_the_default_skin() -> None:
    skins = [finger.skin for finger in fingers(SKIN)]
    assert skins[0] == SKIN
    assert [skin.young_modulus_mpa for skin in skins] == [0.5, 0.25, 1.0, 0.5, 0.5]
    assert [skin.depth_mm for skin in skins] == pytest.approx([0.75, 0.75, 0.75, 0.5, 1.0])


def test_receptors_stay_above_the_bone() -> None:
    deeper = fingers(Skin(thickness_mm=1.0, depth_mm=0.9))[-1].skin
    assert deeper.depth_mm == pytest.approx(0.95)


@pytest.mark.parametrize(
    "number", [0, 1, 2, pytest.param(4, marks=pytest.mark.slow)], ids=["same", "softer", "stiffer", "deeper"]
)
def test_roughness_is_that_of_whole_presses(number: int) -> None:
    reliefs = np.stack([bumps(64), bumps(64, 0.7)])
    finger, values = fingers(SKIN)[number], roughness_by_finger(reliefs, SKIN)[number]
    whole = tactile.roughness(tactile.press(reliefs, skin=finger.skin).strain).numpy()
    # Other depths take what free sides add to the strain from the depth of the given skin.
    assert values == pytest.approx(whole, rel=1e-3 if finger.skin.depth_mm == SKIN.depth_mm else 0.04)
    assert tactile.jnd_apart(values[1], values[0]) == pytest.approx(
        tactile.jnd_apart(whole[1], whole[0]), abs=0.04
    )


def test_fine_patches_are_resampled() -> None:
    fine = roughness_by_finger(bumps(2 * MOST_SAMPLES)[None], SKIN)
    coarse = roughness_by_finger(bumps(MOST_SAMPLES)[None], SKIN)
    assert fine == pytest.approx(coarse, rel=5e-3)
