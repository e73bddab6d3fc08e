"""Every method steps by every model of touch, at one place and at several, and goes on from what it saved."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from optimize.descent.driver import check_memory
from optimize.descent.methods import METHODS
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.settings.run_file import DescentSettings
from relief.relief import Relief
from tactile import Skin
from tactile.model import ModelName
from tests.optimize.conftest import STUDIO
from tests.tactile.reliefs import SIZE, waves
from visual.scene import load_scene

NET_SAMPLES = 128
"""Samples a side that the touch net is trained for."""


@cache
def problem_of(touch: ModelName, repeats: bool) -> Problem:
    """Roughness and contact area as targets, of waves in the paper's studio."""
    heights = waves(NET_SAMPLES if touch == "net" else 32, 1.5).numpy()
    relief = Relief(heights, SIZE, repeats=(repeats, repeats))
    scene = load_scene(STUDIO, {"resolution": "16"}, relief=relief)
    untargeted = Problem(relief, Skin(), Targets(), scene, touch=touch, look="fast", spacing_mm=5.0)
    each = np.ones(untargeted.patches.count)
    return replace(untargeted, targets=Targets.of(0.01, roughness=0.1 * each, contact_area_mm2=30.0 * each))


@pytest.mark.parametrize("repeats", [False, True], ids=["one place", "several places"])
@pytest.mark.parametrize("touch", ["layer", "quick", pytest.param("net", marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", METHODS)
def test_every_method_steps_by_every_model_of_touch(name: str, touch: ModelName, repeats: bool) -> None:
    problem = problem_of(touch, repeats)
    method = METHODS[name].load().of_run(problem, 2, DescentSettings())
    first = method.advance(method.begin(0, problem.heights, {}))
    check_memory(first.memory, METHODS[name].load().checkpoint_schema(first.heights, first.memory))
    second = method.advance(method.begin(first.step, first.heights, first.memory))
    for iterate in (first, second):
        assert iterate.finite()
        assert iterate.heights.dtype == np.float64 and (iterate.heights != problem.heights).any()
        assert all(array.dtype == np.float64 for array in iterate.memory.values())
        assert {values.size for values in iterate.values.values()} == {problem.patches.count}
