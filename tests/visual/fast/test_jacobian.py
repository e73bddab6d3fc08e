"""Jacobians of the fast renderer: those of small changes, and of the renderer's gradient."""

import numpy as np
import torch

from tests.tactile.reliefs import waves
from visual.fast.jacobian import FastView
from visual.fast.renderer import FastRenderer

SIDE = 32


def test_the_jacobian_is_that_of_small_changes(two_lights: FastRenderer) -> None:
    heights, random = waves(SIDE, 1.5).numpy(), np.random.default_rng(0)
    heights = heights + 0.02 * random.normal(size=heights.shape)
    direction = random.normal(size=heights.shape)
    view = FastView(two_lights)
    jacobians = view.evaluate(heights).jacobians
    up, down = (view.evaluate(heights + s * 1e-6 * direction, jacobian=False).pictures for s in (1, -1))
    for jacobian, change in zip(jacobians, (up - down) / 2e-6, strict=True):
        # In norm only: a table's slopes jump from entry to entry, and some face crosses a jump.
        assert np.linalg.norm(jacobian @ direction.ravel() - change.ravel()) < 1e-3 * np.linalg.norm(change)


def test_jacobian_and_gradient_agree(two_lights: FastRenderer) -> None:
    heights, random = waves(SIDE, 1.5), np.random.default_rng(1)
    adjoint = random.normal(size=(2, SIDE, SIDE))
    field = heights.clone().requires_grad_()
    (gradient,) = torch.autograd.grad((two_lights.pictures(field) * torch.as_tensor(adjoint)).sum(), field)
    quarters = adjoint.repeat(2, 1).repeat(2, 2) / 4.0
    jacobians = FastView(two_lights).evaluate(heights.numpy()).jacobians
    explicit = sum(j.T @ a.ravel() for j, a in zip(jacobians, quarters, strict=True)).reshape(SIDE, SIDE)
    assert np.linalg.norm(explicit - gradient.numpy()) < 2e-3 * np.linalg.norm(explicit)


def test_without_edges_the_jacobian_holds_shadows_constant(two_lights: FastRenderer) -> None:
    heights = waves(SIDE, 2.0).numpy()
    whole, still = (FastView(two_lights).evaluate(heights, edges=e).jacobians[0] for e in (True, False))
    assert 0.05 < abs(whole - still).sum() / abs(whole).sum() < 0.95
