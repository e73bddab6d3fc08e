"""Pictures of a step as a torch function of the heights, with their exact gradient.

Fixed samples give pictures with explicit Jacobians (`visual.exact.view`): two reliefs differ by geometry
alone, and the gradient is that of the very pictures. Mitsuba's pictures (`Scene.render`) have noise, a
gradient with noise of its own, and light from face to face.
"""

from typing import Any

import numpy as np
import torch
from torch import Tensor

from visual.looks import StepView


def fixed_pictures(heights: Tensor, views: tuple[StepView, ...], edges: bool) -> Tensor:
    """Pictures (conditions, rows, cols) of a relief (rows, cols) in mm by fixed samples, differentiable.

    Args:
        views: as by a `SceneLook`.
        edges: whether the gradient includes the motion of shadow boundaries and of faces.
    """
    pictures: Tensor = _FixedPictures.apply(heights, views, edges)
    return pictures


class _FixedPictures(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, heights: Tensor, views: tuple[StepView, ...], edges: bool) -> Tensor:
        relief = heights.detach().double().numpy()
        of_views = [view.evaluate(relief, ctx.needs_input_grad[0], edges) for view in views]
        ctx.jacobians = [jacobian for of_view in of_views for jacobian in of_view.jacobians]
        ctx.shape, ctx.dtype = heights.shape, heights.dtype
        return torch.as_tensor(np.concatenate([of_view.pictures for of_view in of_views]))

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None]:
        adjoints = gradients[0].numpy()
        each = [j.T @ adjoint.ravel() for j, adjoint in zip(ctx.jacobians, adjoints, strict=True)]
        total = np.sum(each, axis=0).reshape(ctx.shape)
        return torch.as_tensor(total).to(ctx.dtype), None, None
