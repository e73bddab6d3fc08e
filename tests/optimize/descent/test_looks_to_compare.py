"""Descents by looks to compare with reach the feel; the fast look keeps shadowed pictures better."""

from dataclasses import replace

import numpy as np
import pytest

import tactile
from optimize.descent.adam import AdamDescent
from optimize.descent.driver import descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.settings.run_file import DescentSettings
from optimize.verification.picture_metrics import rms_change
from relief.ground.arrays import Array
from relief.relief import Relief
from tests.tactile.reliefs import SIZE
from tests.visual.scenes import PLASTIC, hills, sun, write_scene
from visual.picture_noise import batched
from visual.scene import load_scene


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """Shadowed hills under three lights, a just-noticeable difference too smooth."""
    lights = [sun(20.0, azimuth) for azimuth in (10.0, 130.0, 250.0)]
    path = write_scene(tmp_path_factory.mktemp("scene"), hills(2.0, 2.5), lights, PLASTIC)
    scene = load_scene(path)
    untargeted = Problem(Relief(scene.heights, SIZE), tactile.Skin(), Targets(), scene, touch="quick")
    before = untargeted.press(scene.heights, gradients=False).means["roughness"]
    return replace(untargeted, targets=Targets.of(0.01, roughness=tactile.jnd_scaled(before, 1.0)))


def look_changed(problem: Problem, heights: Array) -> float:
    before, after = (batched(problem.scene, h, 64, 1).mean for h in (problem.heights, heights))
    return 100.0 * rms_change(before, after) / float(before.mean())


@pytest.mark.slow
def test_what_a_look_does_not_see_it_does_not_keep(problem: Problem) -> None:
    changes: dict[str, float] = {}
    for look in ("fast", "shading", "heights"):
        steered = replace(problem, look=look)
        method = GaussNewton(steered)
        descent = descend(method, steered.targets, method.begin(0, steered.heights, {}), 20)
        assert steered.targets.met(descent.best.values), look
        changes[look] = look_changed(problem, descent.best.heights)
    assert changes["fast"] < 0.9 * changes["shading"] and changes["fast"] < 0.9 * changes["heights"]


@pytest.mark.parametrize("look", ["shading", "heights"])
def test_adam_goes_down_by_them(problem: Problem, look: str) -> None:
    steered = replace(problem, touch="layer", look=look, look_weight=0.01, regularisation=0.006)
    method = AdamDescent(steered, 15, DescentSettings(learning_rate=0.02))
    start = method.begin(0, steered.heights, {})
    descent = descend(method, steered.targets, start, 15)
    error = steered.targets.relative_error
    assert error(descent.best.values) < 0.3 * error(start.values)
    assert 0.0 < descent.best.picture_rms < 100.0
    assert np.isfinite(descent.best.heights).all()
