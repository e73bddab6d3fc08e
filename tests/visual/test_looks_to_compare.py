"""Looks to compare with: shading without shadows and ambient occlusion, and height differences."""

from collections.abc import Callable

import numpy as np
import pytest
import torch

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from tests.recorded import Truths
from tests.visual.differences import pictures_of_mitsuba
from tests.visual.exact.test_view import OBLIQUE
from tests.visual.scenes import LOW, PLASTIC, SIDE, hills, sky, sun
from visual.fast.jacobian import FastView
from visual.height_view import LEVEL, PER_MM, HeightsLook
from visual.looks import FixedSamples
from visual.scene import Scene
from visual.scene_looks import ShadingLook

LIGHTS = sun(35.0, 20.0), sun(50.0, 145.0), sky()
"""Two conditions."""


@pytest.fixture
def shaded(scene_of: Callable[..., Scene]) -> Callable[[Array], Scene]:
    return lambda heights: scene_of(*LIGHTS, heights=heights, material=PLASTIC)


@pytest.mark.slow
def test_shading_of_a_relief_too_gentle_for_shadows_is_that_of_mitsuba(
    shaded: Callable[[Array], Scene], truths: Truths
) -> None:
    gentle = hills(0.15)
    scene = shaded(gentle)
    ours, exact = scene.render(model="shading").numpy(), pictures_of_mitsuba(truths, scene, 1024).mean
    assert np.ptp(exact[0]) > 0.2 * exact[0].mean()
    assert np.abs(ours - exact).mean() < 0.01 * exact.mean()
    steep = scene.render(hills(3.0, 1.0), model="shading").numpy()
    shadowed = scene.render(hills(3.0, 1.0), samples=256).numpy()
    assert steep.mean() > 1.1 * shadowed.mean()


def test_the_jacobian_of_shading_is_that_of_small_changes_and_of_torch(
    shaded: Callable[[Array], Scene],
) -> None:
    heights, random = hills(1.5), np.random.default_rng(0)
    renderer = ShadingLook(shaded(heights)).renderer
    view, direction = FastView(renderer), random.normal(size=heights.shape)
    jacobians = view.evaluate(heights).jacobians
    up, down = (view.evaluate(heights + s * 1e-6 * direction, jacobian=False).pictures for s in (1, -1))
    for jacobian, change in zip(jacobians, (up - down) / 2e-6, strict=True):
        # In norm only: a table's slopes jump from entry to entry, and some face crosses a jump.
        assert np.linalg.norm(jacobian @ direction.ravel() - change.ravel()) < 1e-3 * np.linalg.norm(change)
    adjoint = random.normal(size=(2, SIDE, SIDE))
    field = torch.as_tensor(heights).requires_grad_()
    (gradient,) = torch.autograd.grad((renderer.pictures(field) * torch.as_tensor(adjoint)).sum(), field)
    quarters = adjoint.repeat(2, 1).repeat(2, 2) / 4.0
    explicit = sum(j.T @ a.ravel() for j, a in zip(jacobians, quarters, strict=True)).reshape(SIDE, SIDE)
    assert np.linalg.norm(explicit - gradient.numpy()) < 2e-3 * np.linalg.norm(explicit)


def test_shading_refuses_the_scenes_that_the_fast_look_refuses(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(*LIGHTS, heights=hills(), camera=LOW)
    with pytest.raises(InputError, match=r'at most 70 degrees .*; use look.model = "exact"$'):
        scene.render(model="shading")


def test_shading_from_the_side_has_no_shadows(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(*LIGHTS, heights=hills(), camera=OBLIQUE)
    shaded, shadowed = (scene.render(model=model) for model in ("shading", "fast"))
    assert (shaded >= shadowed - 1e-12).all() and shaded.mean() > 1.02 * shadowed.mean()
    direction = np.random.default_rng(0).normal(size=hills().shape)
    (view,) = scene.look("shading").views(FixedSamples())
    jacobians = view.evaluate(hills()).jacobians
    up, down = (view.evaluate(hills() + s * 1e-6 * direction, jacobian=False).pictures for s in (1, -1))
    for jacobian, change in zip(jacobians, (up - down) / 2e-6, strict=True):
        assert np.linalg.norm(jacobian @ direction.ravel() - change.ravel()) < 2e-3 * np.linalg.norm(change)


def test_height_differences_of_any_scene(scene_of: Callable[..., Scene]) -> None:
    original, random = hills(), np.random.default_rng(1)
    scene = scene_of(*LIGHTS, heights=original, camera=OBLIQUE)
    change = random.normal(size=original.shape)
    field = torch.as_tensor(original + change).requires_grad_()
    values = scene.render(field, model="heights")
    assert values.shape == (2, SIDE, SIDE)
    np.testing.assert_allclose(scene.render(model="heights").numpy(), LEVEL)
    view = HeightsLook(scene)
    evaluated = view.evaluate(original + change)
    np.testing.assert_allclose(evaluated.pictures, values.detach().numpy())
    for jacobian, difference in zip(evaluated.jacobians, evaluated.pictures - LEVEL, strict=True):
        # Linear, so that one difference of any length is the derivative.
        np.testing.assert_allclose(jacobian @ change.ravel(), difference.ravel(), atol=1e-12)
    (gradient,) = torch.autograd.grad(values[1].sum(), field)
    np.testing.assert_allclose(gradient.numpy(), LEVEL * PER_MM)
