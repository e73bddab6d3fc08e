"""Of a relief higher than 3 mm, a descent changes what a finger reaches, and nothing below."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import tactile
from optimize.descent.adam import AdamDescent
from optimize.descent.driver import DescentMethod, descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.settings.run_file import DescentSettings
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.heightmap import save_heights_exr
from relief.relief import Relief
from tactile.measures import measure_touch
from tests.tactile.reliefs import SIZE
from visual.scene import Scene, load_scene

SAMPLES = 64
DEPTH_MM = 5.0
SKIN = tactile.Skin()


def pyramids(samples: int = SAMPLES, period: float = 2.5, top: float = 0.6) -> Array:
    """Blunt pyramids with grooves 5 mm deep; `top` is the share of the period that is flat."""
    x = (np.arange(samples) + 0.5) * SIZE / samples
    from_middle = 2.0 * np.abs((x / period) % 1.0 - 0.5)
    outward = np.maximum.outer(from_middle, from_middle)
    return DEPTH_MM * np.clip((1.0 - outward) / (1.0 - top), 0.0, 1.0)


def wavy_pyramids() -> Array:
    """Pyramids of several heights: their tops are 0 to 0.6 mm below the highest."""
    x = (np.arange(SAMPLES) + 0.5) * SIZE / SAMPLES
    wave = 0.15 * (2.0 + np.cos(2.0 * np.pi * x / 5.0)[:, None] + np.cos(2.0 * np.pi * x / 3.3)[None, :])
    heights = pyramids() * (1.0 - (0.6 - wave) / DEPTH_MM)
    return np.asarray(heights * (DEPTH_MM / heights.max()))


@pytest.fixture(scope="module")
def deep_scene(studio: Path, tmp_path_factory: pytest.TempPathFactory) -> Scene:
    path = tmp_path_factory.mktemp("deep") / "pyramids.exr"
    save_heights_exr(path, wavy_pyramids(), SIZE)
    return load_scene(studio, {"resolution": str(SAMPLES)}, texture=path)


def deep_problem(scene: Scene, jnd: float) -> Problem:
    before = measure_touch(Relief(scene.heights, SIZE), SKIN, "quick").means["roughness"]
    targets = Targets.of(0.01, roughness=tactile.jnd_scaled(before, jnd))
    return Problem(Relief(scene.heights, SIZE), SKIN, targets, scene, touch="quick", look="fast")


@pytest.mark.usefixtures("tight_contact")
def test_the_contact_is_that_of_the_whole_relief_and_of_a_deeper_cut() -> None:
    heights = pyramids(32)
    cut = [np.maximum(heights, DEPTH_MM - depth) for depth in (3.0, 4.0, DEPTH_MM)]
    shallow, deeper, whole = (tactile.press(field, SIZE, SKIN) for field in cut)
    for touch in (shallow, deeper):
        torch.testing.assert_close(touch.pressure, whole.pressure, rtol=1e-6, atol=1e-9)
    measured = measure_touch(Relief(heights, SIZE), SKIN, "layer").pressure[0]
    np.testing.assert_allclose(measured, whole.pressure.numpy(), rtol=1e-6, atol=1e-9)


def test_a_finger_that_reaches_the_cut_is_refused() -> None:
    spikes = np.zeros((32, 32))
    spikes[8::16, 8::16] = DEPTH_MM
    with pytest.raises(InputError, match=r"heights: a finger reaches .* mm below the top; the most is 2\.9"):
        measure_touch(Relief(spikes, SIZE), SKIN, "layer")


def steps_of(problem: Problem, method: str) -> Array:
    """The relief after some steps."""
    steps = 8 if method == "gauss-newton" else 4
    walker: DescentMethod = GaussNewton(problem)
    if method == "adam":
        walker = AdamDescent(problem, steps, DescentSettings())
    return descend(walker, problem.targets, walker.begin(0, problem.heights, {}), steps).last.heights


@pytest.mark.parametrize("method", ["gauss-newton", "adam"])
def test_what_no_finger_reaches_stays_bit_for_bit(deep_scene: Scene, method: str) -> None:
    problem = deep_problem(deep_scene, -1.0)
    if method == "adam":
        problem = replace(problem, touch="layer")
    low = problem.frozen
    assert low is not None and 0.1 < low.mean() < 0.9
    heights = steps_of(problem, method)
    np.testing.assert_array_equal(heights[low], problem.heights[low])
    assert np.abs(heights - problem.heights)[~low].max() > 1e-3
    assert heights[~low].min() >= problem.heights.max() - HEIGHT_LIMIT_MM
    assert heights.max() <= problem.heights.max()
    before, after = (problem.press(relief).means["roughness"] for relief in (problem.heights, heights))
    assert after < before


def test_the_target_is_met_by_finite_elements_too(deep_scene: Scene) -> None:
    problem = deep_problem(deep_scene, -1.0)
    heights = steps_of(problem, "gauss-newton")
    before, after = (
        measure_touch(Relief(relief, SIZE), SKIN, "fem", mesh=32).means["roughness"]
        for relief in (problem.heights, heights)
    )
    assert tactile.jnd_apart(after, before) == pytest.approx(-1.0, abs=0.15)


def test_gradients_by_what_stays_are_zero(deep_scene: Scene) -> None:
    problem = deep_problem(deep_scene, 1.0)
    gradients = problem.press(problem.heights).gradients
    assert problem.frozen is not None and isinstance(gradients, np.ndarray)
    assert not gradients[:, problem.frozen.ravel()].any() and gradients.any()


def test_scaling_for_comparison_lowers_the_whole_relief_and_never_raises_it(deep_scene: Scene) -> None:
    problem = deep_problem(deep_scene, -1.0)
    scaled = linear_scaling(problem)
    assert scaled is not None
    relief = problem.heights - problem.heights.min()
    ratio = scaled[relief > 0.0] / relief[relief > 0.0]
    assert ratio.max() < 1.0 and np.ptp(ratio) < 1e-9
    assert linear_scaling(deep_problem(deep_scene, 6.0)) is None
