"""Descents by the fast look reach the feel, and Mitsuba, which they do not ask, finds the look kept."""

import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import tactile
from optimize.descent.adam import AdamDescent
from optimize.descent.driver import DescentMethod, DescentResult, descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.methods import ADAM_LOOK_WEIGHT
from optimize.descent.problem import Problem
from optimize.descent.stop_reason import StopReason
from optimize.descent.targets import Targets
from optimize.settings.run_file import DescentSettings
from optimize.verification.picture_metrics import rms_change
from retouch.laboratory.training.look import openness
from retouch.laboratory.training.setup import card_samples
from surrogate.nets.weights import load_net
from tests.tactile.reliefs import SIZE, waves
from tests.visual.scenes import PLASTIC, sun, write_scene
from visual.fast.ambient_net import KIND
from visual.picture_noise import batched
from visual.scene import load_scene

SAMPLES, TOLERANCE = 32, 0.01


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Problem:
    """Waves under three lights and no sky, two just-noticeable differences too smooth."""
    lights = [sun(35.0, azimuth) for azimuth in (10.0, 130.0, 250.0)]
    path = write_scene(tmp_path_factory.mktemp("scene"), waves(SAMPLES, 1.5).numpy(), lights, PLASTIC)
    scene = load_scene(path)
    untargeted = partial(Problem, scene.relief, tactile.Skin(), scene=scene, look="fast")
    before = untargeted(targets=Targets()).press(scene.heights, gradients=False)
    return untargeted(
        targets=Targets.of(TOLERANCE, roughness=tactile.jnd_scaled(before.means["roughness"], 2))
    )


def walk(problem: Problem, method: DescentMethod, steps: int) -> DescentResult:
    return descend(method, problem.targets, method.begin(0, problem.heights, {}), steps)


def change_of_look(problem: Problem, heights: np.ndarray) -> float:
    before, after = (batched(problem.scene, h, 64, 1).mean for h in (problem.heights, heights))
    return 100.0 * rms_change(before, after) / float(before.mean())


def test_gauss_newton_keeps_the_look_better_than_scaling(problem: Problem) -> None:
    descent = walk(problem, GaussNewton(problem), 20)
    assert descent.reason is StopReason.CONVERGED
    assert problem.targets.relative_error(descent.best.values) <= TOLERANCE
    scaled = linear_scaling(problem)
    assert scaled is not None
    assert 2.3 * change_of_look(problem, descent.best.heights) < change_of_look(problem, scaled)


def test_a_descent_by_both_fast_models_arrives_where_the_layer_finds_it(problem: Problem) -> None:
    fast = replace(problem, touch="quick")
    descent = walk(fast, GaussNewton(fast), 20)
    assert descent.reason is StopReason.CONVERGED
    felt = problem.press(descent.best.heights, gradients=False)
    assert problem.targets.relative_error(felt.values) <= 3.0 * TOLERANCE


def test_its_steps_import_no_mitsuba(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """The tables of its material are Mitsuba's; after that it is not asked again."""
    fast = replace(problem, touch="quick")
    method = GaussNewton(fast)
    for name in [name for name in sys.modules if name.partition(".")[0] in ("mitsuba", "drjit")]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError):
        import mitsuba  # noqa: F401
    descent = walk(fast, method, 3)
    assert descent.last.step == 3 and descent.last.picture_rms > 0.0


@pytest.mark.slow
def test_adam_goes_down_by_it(problem: Problem) -> None:
    weighted = replace(problem, look_weight=ADAM_LOOK_WEIGHT)
    descent = walk(problem, AdamDescent(weighted, 30, DescentSettings(learning_rate=0.01)), 30)
    start = problem.targets.relative_error(problem.press(problem.heights, gradients=False).values)
    assert problem.targets.relative_error(descent.best.values) < 0.2 * start
    assert 0.0 < change_of_look(problem, descent.best.heights) < 25.0


def test_the_net_that_is_shipped_makes_of_its_sample_what_its_card_tells() -> None:
    net, card = load_net(KIND)
    assert card.sample
    found = card_samples(int(card.valid["samples"]), partial(openness, net, size_mm=SIZE))
    for told, made in zip(card.sample, found, strict=True):
        assert (told.seed, told.index) == (made.seed, made.index)
        assert made.figures == pytest.approx(dict(told.figures), rel=1e-3, abs=1e-4)
