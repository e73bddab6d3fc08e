"""Largest compressive principal strain, with a gradient that stays finite where eigenvalues meet."""

import math
from typing import Any, Protocol

import torch
from torch import Tensor

STRAIN_COMPONENTS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
"""Index pairs of the six strains on the axes (row, column, depth), in the order in which they are stored."""


def smallest_eigenvalue(components: Tensor) -> Tensor:
    """Smallest eigenvalue of symmetric 3 x 3 tensors in closed form (Smith, Comm. ACM 4, 1961).

    Args:
        components: (..., 6, rows, cols), ordered xx, yy, zz, yz, xz, xy.

    Returns:
        (..., rows, cols). The derivative n n' (n the eigenvector) comes from the adjugate of A - lambda I
        rather than from the arc cosine, whose slope is infinite in uniaxial compression, the commonest state
        of the skin.
    """
    return _SmallestEigenvalue.apply(components)


class _SmallestEigenvalue(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, components: Tensor) -> Tensor:
        xx, yy, zz, yz, xz, xy = components.unbind(-3)
        mean = (xx + yy + zz) / 3.0
        a, b, c = xx - mean, yy - mean, zz - mean
        spread = ((a * a + b * b + c * c + 2.0 * (yz * yz + xz * xz + xy * xy)) / 6.0).clamp_min(1e-30).sqrt()
        a, b, c, f, g, h = (t / spread for t in (a, b, c, yz, xz, xy))
        half_determinant = 0.5 * (a * (b * c - f * f) - h * (h * c - f * g) + g * (h * f - b * g))
        angle = torch.acos(half_determinant.clamp(-1.0, 1.0)) / 3.0
        value = mean + 2.0 * spread * torch.cos(angle + 2.0 * math.pi / 3.0)
        ctx.save_for_backward(components, value)
        return value

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> Tensor:
        components, value = ctx.saved_tensors
        xx, yy, zz, yz, xz, xy = components.unbind(-3)
        a, b, c = xx - value, yy - value, zz - value
        adjugate = torch.stack(
            (
                b * c - yz * yz,
                a * c - xz * xz,
                a * b - xy * xy,
                xy * xz - a * yz,
                xy * yz - b * xz,
                xz * yz - c * xy,
            ),
            dim=-3,
        )
        trace = adjugate[..., :3, :, :].sum(-3, keepdim=True)
        # Where the two smallest eigenvalues meet the trace vanishes; there the isotropic mean is a
        # subgradient.
        size = components.square().sum(-3, keepdim=True)
        projector = adjugate / trace.clamp_min(torch.finfo(value.dtype).tiny)
        meeting = trace <= 16.0 * torch.finfo(value.dtype).eps * size
        isotropic = torch.zeros_like(projector)
        isotropic[..., :3, :, :] = 1.0 / 3.0
        projector = torch.where(meeting, isotropic, projector)
        # Each off-diagonal component is two entries of the tensor.
        weight = projector.new_tensor([1.0, 1.0, 1.0, 2.0, 2.0, 2.0]).view(6, 1, 1)
        return projector * weight * gradients[0].unsqueeze(-3)


class StrainOperator(Protocol):
    """Skin as a linear map from pressures (..., n, n) in units of E to strains (..., 6, n, n)."""

    def strain(self, pressure: Tensor) -> Tensor:
        """Components as in `STRAIN_COMPONENTS`."""


def principal_strain(operator: StrainOperator, pressure: Tensor) -> Tensor:
    """(..., n, n) largest compressive principal strain under pressures (..., n, n) in units of E."""
    return smallest_eigenvalue(operator.strain(pressure))
