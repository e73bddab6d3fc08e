"""The paper's energies (section 4.1), one function each; torch in, torch out, differentiable."""

import torch
from torch import Tensor

CLAMP_WEIGHT = 1e5
"""w3: high, so that the clamp works as a constraint."""


def target_energy(value: Tensor, goal: float) -> Tensor:
    """E_rough = |r_trg - V| (term 1) or E_contact = |c_trg - A| in mm² (term 2), of a scalar."""
    return (goal - value).abs()


def visual_energy(pictures: Tensor, targets: Tensor, weights: Tensor) -> Tensor:
    """E_vis = sum over conditions of their weight times 1/n ||I0 - I||_2 (term 3).

    Args:
        pictures, targets: (conditions, rows, cols) pixel values, white = 1.
        weights: (conditions,).
    """
    return _norms(pictures - targets) @ weights / pictures[0].numel()


def regularisation_energy(pictures: Tensor, targets: Tensor, weights: Tensor) -> Tensor:
    """E_reg: the same norm of the horizontal and vertical differences of the picture difference (term 4)."""
    difference = pictures - targets
    across, down = difference.diff(dim=-1), difference.diff(dim=-2)
    return (_norms(across) + _norms(down)) @ weights / pictures[0].numel()


def clamp_energy(heights: Tensor, limit: float) -> Tensor:
    """E_clamp = ||H - clamp(H, 0, H_trg)||² (term 5), mm²."""
    return (heights - heights.clamp(0.0, limit)).square().sum()


def _norms(difference: Tensor) -> Tensor:
    # The tiny constant gives a start from the target itself, where a norm has no gradient, the gradient 0.
    return torch.sqrt(difference.square().sum((-2, -1)) + 1e-12)
