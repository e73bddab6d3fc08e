"""Drafts: a few steps by fast models come close to what a whole descent reaches."""

import math
from dataclasses import replace

import numpy as np
import pytest

import tactile
from optimize.descent.driver import Iterate, descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.estimates import drafts
from optimize.estimates.drafts import Drafter
from optimize.settings.look import Look
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.relief import Relief
from tactile.jnd import ROUGHNESS_JND
from tactile.skin import Skin
from tests.visual.scenes import hills
from visual.scene import Scene, load_scene

CHANGE_RATIO, JND_OFF = 1.3, 0.15
"""How far drafts may be from what follows: as docs/evidence/speed.md has it for the bundled textures."""


def scene_of(heights: Array) -> Scene:
    return load_scene("studio", {"resolution": str(len(heights))}, relief=Relief.of(heights, 4.0))


def goal(original: Array, jnd: float) -> Targets:
    return Targets.of(0.01, roughness=[tactile.jnd_scaled(float(one), jnd) for one in original])


def jnd_of(reached: Iterate, original: Array) -> float:
    return math.log(reached.means["roughness"] / original.mean()) / math.log(ROUGHNESS_JND)


@pytest.mark.slow
@pytest.mark.parametrize("jnd", [2.0, -2.0])
def test_a_draft_is_close_to_the_descent_of_a_run(jnd: float) -> None:
    scene = scene_of(hills(0.8, seed=11))
    drafter = Drafter(scene, Skin())
    own = drafter.original["roughness"]
    targets = goal(own, jnd)
    reached, change = drafter.step(targets)
    for _ in range(2):
        reached, change = drafter.step(targets, reached.heights, reached.memory)
    problem = Problem(scene.relief, Skin(), targets, scene, touch="quick", look="fast", broad=Look().broad)
    method = GaussNewton(problem)
    whole = descend(method, targets, method.begin(0, scene.heights, {}), 25)
    assert whole.reason.met
    assert abs(jnd_of(reached, own) - jnd_of(whole.best, own)) < JND_OFF
    assert drafter._changed(whole.best.heights) / CHANGE_RATIO < change
    assert change < CHANGE_RATIO * drafter._changed(whole.best.heights)


def test_a_known_result_nearby_takes_one_step_and_the_way_there_hardly_matters() -> None:
    drafter = Drafter(scene_of(hills(0.8, seed=5)), Skin())
    own = drafter.original["roughness"]
    half, _ = drafter.step(goal(own, 0.5))
    onward, by_half = drafter.step(goal(own, 1.0), half.heights)
    direct, at_once = drafter.step(goal(own, 1.0))
    assert goal(own, 1.0).met(onward.values)
    assert jnd_of(direct, own) == pytest.approx(jnd_of(onward, own), abs=JND_OFF)
    assert by_half == pytest.approx(at_once, rel=0.2)


def test_jacobians_that_wait_make_the_same_steps() -> None:
    scene = scene_of(hills(0.8, seed=5))
    drafter = Drafter(scene, Skin())
    targets = goal(drafter.original["roughness"], 1.0)
    first, _ = drafter.step(targets)
    second, _ = drafter.step(targets, first.heights, first.memory)
    method = GaussNewton(replace(drafter._problem, targets=targets))
    iterate = method.begin(0, scene.heights, {})
    for drafted in (first, second):
        iterate = method.advance(iterate)
        assert np.array_equal(drafted.heights, iterate.heights)
    again, _ = drafter.step(targets)
    assert np.array_equal(again.heights, first.heights)


def test_what_has_no_draft_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="flat"):
        Drafter(scene_of(np.full((16, 16), 0.5)), Skin())
    monkeypatch.setattr(drafts, "MOST_SAMPLES", 16 * 16)
    with pytest.raises(InputError, match="more than 256 x 256 samples"):
        Drafter(scene_of(hills(0.8)), Skin())
