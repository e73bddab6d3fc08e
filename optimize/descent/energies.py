"""The paper's energies (section 4.1), one function each; torch in, torch out, differentiable.

The paper's pictures have 128 x 128 pixels with values up to 255, and 1/n ||.||_2 there is 255/128 times the
root mean square in units of white. That number is taken for pictures of any size, so that a weight means the
same at every resolution. The paper's bound of the visual energy, 8, is 2 % of pixel values: three norms of
2 % of white over 128 x 128 pixels, without 1/n and with white = 1, add up to 7.7.
"""

import torch
from numpy.typing import ArrayLike
from torch import Tensor

PAPER_WHITE, PAPER_SIDE = 255.0, 128
"""Pixel value of white, and pixels along a side of the paper's pictures."""
UNIT = PAPER_WHITE / PAPER_SIDE
"""Energy of a condition whose pixels all change by white."""
VISUAL_BOUND = 0.02
"""Root mean square change of a condition at which the paper's stopping rule holds, on average, as a share
of white."""


def target_energy(value: Tensor, goal: ArrayLike) -> Tensor:
    """E_rough = |r_trg - V| (term 1) or E_contact = |c_trg - A| in mm² (term 2), the sum over the touches.

    Args:
        value: (k,) over the touches, or of one touch without dimensions.
        goal: (k,), or a number for all.
    """
    return (torch.as_tensor(goal) - value.reshape(-1)).abs().sum()


def visual_energy(pictures: Tensor, targets: Tensor, weights: Tensor) -> Tensor:
    """E_vis = sum over conditions of their weight times 1/n ||I0 - I||_2 (term 3), in the paper's unit.

    Args:
        pictures, targets: (conditions, rows, cols) pixel values, white = 1.
        weights: (conditions,).
    """
    return UNIT * _root_means(pictures - targets) @ weights


def regularisation_energy(pictures: Tensor, targets: Tensor, weights: Tensor) -> Tensor:
    """E_reg: the same norm of the horizontal and vertical differences of the picture difference (term 4)."""
    difference = pictures - targets
    pixels = difference[0].numel()
    across, down = difference.diff(dim=-1), difference.diff(dim=-2)
    return UNIT * (_root_means(across, pixels) + _root_means(down, pixels)) @ weights


def visual_bound(weights: Tensor) -> float:
    """Value of E_vis below which the paper's stopping rule holds, for conditions with these weights."""
    return VISUAL_BOUND * UNIT * float(weights.sum())


def _root_means(difference: Tensor, pixels: int | None = None) -> Tensor:
    # The tiny constant gives a start from the target itself, where a norm has no gradient, the gradient 0.
    square = difference.square().sum((-2, -1)) / (pixels or difference[0].numel())
    return torch.sqrt(square + 1e-16)
