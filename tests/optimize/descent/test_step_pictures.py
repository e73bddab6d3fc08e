"""Pictures by fixed samples as a torch function: their gradient is that of the Jacobians."""

import numpy as np
import torch

from visual.scene import Scene
from visual.step_pictures import fixed_pictures

SIDE = 48


def test_the_gradient_is_that_of_the_jacobians(scene: Scene) -> None:
    views = scene.views(SIDE, strata=2)
    heights = torch.tensor(scene.heights, requires_grad=True)
    pictures = fixed_pictures(heights, views, edges=True)
    assert pictures.shape == (len(scene.conditions), SIDE, SIDE)
    adjoint = torch.randn(pictures.shape, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    (gradient,) = torch.autograd.grad((pictures * adjoint).sum(), heights)
    direction = np.random.default_rng(1).standard_normal(scene.heights.shape)
    of_view = views[0].evaluate(scene.heights)
    moved = np.stack([jacobian @ direction.ravel() for jacobian in of_view.jacobians])
    np.testing.assert_allclose(
        np.vdot(gradient.numpy(), direction),
        np.vdot(adjoint.numpy().reshape(len(moved), -1), moved),
        rtol=1e-10,
    )


def test_without_a_gradient_no_jacobian_is_made(scene: Scene) -> None:
    views = scene.views(SIDE, strata=2)
    pictures = fixed_pictures(torch.tensor(scene.heights), views, edges=True)
    assert not pictures.requires_grad
    np.testing.assert_array_equal(pictures.numpy(), views[0].evaluate(scene.heights, jacobian=False).pictures)
