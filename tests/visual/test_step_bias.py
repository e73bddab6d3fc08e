"""The pictures of steps against rendered ones: the noise of neither counts, what steps do not see does."""

from collections.abc import Callable

import numpy as np
import pytest

from relief.ground.arrays import Array
from tests.visual.scenes import MATTE, PANEL, PLASTIC, SIDE, hills, sky, sun
from visual.backend import variants
from visual.backend.mitsuba import mi
from visual.looks import EXACT
from visual.scene import Scene
from visual.step_bias import bias_line, pictures_of_steps, step_bias

pytestmark = pytest.mark.usefixtures("mi")

GLOSSY = PLASTIC.replace('"alpha" value="0.3"', '"alpha" value="0.02"')

ASIDE = PANEL.replace('<translate z="8"/>', '<scale value="4"/><translate x="14" z="8"/>')
"""A large panel that the camera above does not see."""


def biased(scene: Scene, share: float, seed: int) -> Array:
    """Pictures of steps that are a share of the mean radiance off, half of the pixels up, the others down."""
    pictures = pictures_of_steps(scene, "exact", scene.heights, seed)
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], pictures.shape[1:])
    return pictures + share * pictures.mean((0, 2, 3), keepdims=True)[0] * signs


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, 0.03, 0.05])
def test_a_known_bias_is_found_whatever_the_noise(
    scene_of: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch, share: float
) -> None:
    monkeypatch.setattr("visual.step_bias.SAMPLES", 2)
    scene = scene_of(
        sun(20), sun(60, 150), sky(), heights=hills(2.5, 0.7), material=PLASTIC, rows=24, cols=24
    )
    found = np.array(
        [step_bias(scene, "exact", seed=seed, steps=biased(scene, share, seed)) for seed in range(4)]
    )
    pictures = pictures_of_steps(scene, "exact", scene.heights)
    raw = np.sqrt(np.square(pictures[1] - pictures[0]).mean()) / pictures.mean()
    assert raw > 0.02
    np.testing.assert_allclose(np.square(found).mean(0), share**2, atol=4e-4)
    lines = [bias_line(scene, "exact", one) for one in found]
    assert [line is not None for line in lines] == [share == 0.05] * 4


@pytest.mark.slow
def test_light_from_face_to_face_is_no_bias(scene_of: Callable[..., Scene]) -> None:
    bright = MATTE.replace('"0.5"', '"0.95"')
    bias = step_bias(scene_of(sun(35), sky(), material=bright, max_depth=8), "exact")
    assert bias.max() < 0.02


@pytest.mark.slow
def test_the_condition_with_a_bias_is_named(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(35, name="far"), ASIDE, material=GLOSSY)
    assert step_bias(scene, "exact").max() < 0.03  # highlights are sampled
    bias = np.array([0.0, 0.0876])
    line = bias_line(scene, "exact", bias)
    assert line is not None and "scene.xml: panel: the pictures by which steps steer differ" in line
    assert " by 8.8 %" in line and "highlight" in line and "alpha" in line
    assert "far" not in line and len(line.splitlines()) == 1


@pytest.mark.slow
def test_the_fast_look_is_compared_too(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(15, name="low"), sun(60, 150, name="high"), material=PLASTIC)
    assert step_bias(scene, "fast").max() < 0.1
    shadeless = step_bias(scene, "shading")
    assert shadeless[0] > 0.05
    line = bias_line(scene, "shading", shadeless)
    assert line is not None and line.count("low") == 1 and 'look.model = "exact"' in line


def test_black_pictures_have_no_bias(scene_of: Callable[..., Scene]) -> None:
    bias = step_bias(scene_of(sun(35), sun(60, irradiance=0.0)), "exact")
    assert bias[1] == 0.0 and bias[0] < 0.03


def test_the_plate_alone_counts(scene_of: Callable[..., Scene]) -> None:
    """A camera that sees twice as much sees half as many pixels of the plate."""
    wide = '<scale x="10" y="10"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>'
    scene = scene_of(sun(35), material=PLASTIC, camera=wide)
    shown = scene.plate_weights()[0] > 0.0
    assert 0.2 < shown.mean() < 0.3
    steps = pictures_of_steps(scene, "exact", scene.heights)
    assert step_bias(scene, "exact", steps=steps + ~shown).max() < 0.03
    assert len(shown) == SIDE


@pytest.mark.gradients
def test_the_variant_of_the_user_does_not_matter(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(40.0, irradiance="3 2 1"))
    expected = step_bias(scene, EXACT)
    variants.use("llvm_ad_mono")
    np.testing.assert_array_equal(step_bias(scene, EXACT), expected)
    assert mi.variant() == "llvm_ad_mono"
