"""Weights by local contrast: more for smooth parts, none without contrast, and followed by the descent."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import tactile
from optimize.descent.driver import descend
from optimize.descent.gauss_newton.masking import masking_weights
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.settings.run_file import run_from_scene
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.relief import Relief
from tests.tactile.reliefs import SIZE, waves
from tests.visual.scenes import PLASTIC, sun, write_scene
from visual.scene import load_scene


def test_smooth_parts_weigh_more_and_all_alike_without_strength_or_contrast() -> None:
    picture = np.full((64, 64), 0.5)
    picture[:, 32:] += 0.2 * np.random.default_rng(0).normal(size=(64, 32))
    pictures = np.stack((picture, np.full((64, 64), 0.3), np.zeros((64, 64))))
    weights = masking_weights(pictures, 2.0)
    assert weights[0, :, :16].mean() > 2.5 * weights[0, :, 48:].mean()
    np.testing.assert_allclose(weights.mean((1, 2)), 1.0)
    np.testing.assert_allclose(weights[1:], 1.0)
    np.testing.assert_allclose(masking_weights(pictures, 0.0), 1.0)


def test_a_descent_keeps_the_smooth_part_better_by_masking(tmp_path: Path) -> None:
    relief = waves(32, 0.6).numpy()
    relief[:, 16:] += 0.4 * np.random.default_rng(0).random((32, 16))
    scene = load_scene(write_scene(tmp_path, relief, [sun(35.0, 10.0)], PLASTIC))
    problem = Problem(Relief(relief, SIZE), tactile.Skin(), Targets(), scene, touch="quick", look="fast")
    before = problem.press(relief, gradients=False).means["roughness"]
    problem = replace(problem, targets=Targets.of(0.01, roughness=tactile.jnd_scaled(before, 1.0)))

    def changed(masking: float) -> Array:
        masked = replace(problem, masking=masking)
        method = GaussNewton(masked)
        best = descend(method, masked.targets, method.begin(0, relief, {}), 15).best
        assert masked.targets.met(best.values)
        shown = (scene.render(heights, model="fast").numpy()[0] for heights in (relief, best.heights))
        return np.square(np.subtract(*shown))

    plain, masked = changed(0.0), changed(8.0)
    share_plain, share_masked = (one[:, :12].sum() / one.sum() for one in (plain, masked))
    assert share_masked < 0.9 * share_plain


def test_other_methods_refuse_it() -> None:
    with pytest.raises(InputError, match=r"look\.masking: adam has no weights by contrast"):
        run_from_scene("studio", "gravel", ["touch.jnd=1", "look.masking=2", "descent.method=adam"])
