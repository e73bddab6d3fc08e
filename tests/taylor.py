"""Proofs of derivatives: a gradient's Taylor remainder falls with rate 2, an operator passes the dot test."""

from collections.abc import Callable, Sequence

import numpy as np
import torch
from torch import Tensor

Function = Callable[[Tensor], Tensor]


def gradient(function: Function, at: Tensor) -> Tensor:
    """Gradient of a scalar function of one tensor."""
    variable = at.detach().clone().requires_grad_()
    (result,) = torch.autograd.grad(function(variable), variable)
    return result


def slope_error(function: Function, at: Tensor, direction: Tensor, step: float, scale: float = 0.0) -> float:
    """Relative difference between the gradient's slope along `direction` and a central difference.

    Args:
        step: half the width of the difference.
        scale: slopes smaller than this count as this large (one that vanishes has no relative error).
    """
    slope = float((gradient(function, at) * direction).sum())
    with torch.no_grad():
        measured = float(function(at + step * direction) - function(at - step * direction)) / (2.0 * step)
    return abs(measured - slope) / max(abs(measured), scale)


def taylor_rates(function: Function, at: Tensor, direction: Tensor, steps: Sequence[float]) -> list[float]:
    """Observed rates of the remainder |f(x + e d) - f(x) - e f'(x) d| between successive steps e.

    2 where f is smooth, 1 if f' is wrong (the Taylor test: Farrell et al., SIAM J. Sci. Comput. 35, 2013).
    """
    slope = float((gradient(function, at) * direction).sum())
    with torch.no_grad():
        value = float(function(at))
        remainders = [abs(float(function(at + e * direction)) - value - e * slope) for e in steps]
    sizes = np.log(np.asarray(steps))
    return list(np.diff(np.log(remainders)) / np.diff(sizes))


def dot_test(forward: Function, adjoint: Function, x: Tensor, y: Tensor) -> float:
    """|<A x, y> - <x, A' y>| relative to |A x| |y|: rounding error if the two are one another's adjoint."""
    image = forward(x)
    mismatch = (image * y).sum() - (x * adjoint(y)).sum()
    return float(mismatch.abs() / (image.norm() * y.norm()))
