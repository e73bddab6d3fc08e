"""Roughness: mean variation of strain between pairs of receptors (paper equation 2)."""

import math
from functools import lru_cache
from typing import Any, Literal

import torch
from torch import Tensor

from relief.errors import InputError
from relief.limits import PATCH_SIDE_MM

PAIR_DISTANCE_MM = 2.2
"""Mean distance d of a pair of receptors, mm (paper section 4.2)."""

PAIR_SPREAD_MM = 0.8
"""Half-width r of the range of distances, mm (paper section 4.2)."""

QUADRATURE_LENGTHS, QUADRATURE_ANGLES = 4, 16
"""Numbers of lengths and angles of the polar quadrature: V within 0.65 % of the full sum, cosine of the
gradients 0.9986, a 28th of the work."""

Quadrature = Literal["full", "polar"]
"""Sum over every pixel offset, or over few lengths and angles."""


def roughness(strain: Tensor, size_mm: float = PATCH_SIDE_MM, quadrature: Quadrature = "full") -> Tensor:
    """V = mean over positions p and offsets o of |s(p) - s(p + o)| (paper equation 2).

    Offsets have length in [d - r, d + r] = [1.4, 3.0] mm and direction in [0, pi), uniform in (length,
    angle), that is weight 1/length per unit of area. Pairs with an end outside the patch are left out. (The
    paper's printed formula has cos twice, and a prefactor that does not normalise; the mean agrees with the
    paper's sampler of 8000 pairs.)

    Args:
        strain: (..., n, n), dimensionless.
        size_mm: side of the patch.
        quadrature: "full" sums over every pixel offset (for every number reported); "polar" over 4 lengths x
            16 angles.

    Returns:
        (...) roughness, with gradient.

    Raises:
        InputError: the patch is too small for the widest pairs, or too coarse for any; an unknown quadrature.
    """
    if quadrature not in _OFFSETS:
        raise InputError(f'quadrature: "{quadrature}" is not one of "full", "polar"')
    return _PairVariation.apply(strain, _OFFSETS[quadrature](strain.shape[-1], size_mm))


class _PairVariation(torch.autograd.Function):
    """Value and sign-gradient in one pass over the offsets."""

    @staticmethod
    def forward(ctx: Any, strain: Tensor, offsets: tuple[tuple[int, int, float], ...]) -> Tensor:
        n = strain.shape[-1]
        s = strain.detach()
        value = s.new_zeros(s.shape[:-2])
        wanted = ctx.needs_input_grad[0]
        gradient = torch.zeros_like(s) if wanted else None
        pairs = 0.0
        for down, right, weight in offsets:
            here = (slice(0, n - down), slice(max(0, -right), n - max(0, right)))
            there = (slice(down, n), slice(max(0, right), n + min(0, right)))
            difference = s[(..., *here)] - s[(..., *there)]
            pairs += weight * difference.shape[-2] * difference.shape[-1]
            if gradient is None:
                value += weight * difference.abs().sum((-2, -1))
            else:
                sign = difference.sign()
                value += weight * torch.linalg.vecdot(difference.flatten(-2), sign.flatten(-2))
                gradient[(..., *here)].add_(sign, alpha=weight)
                gradient[(..., *there)].sub_(sign, alpha=weight)
        if gradient is not None:
            ctx.save_for_backward(gradient / pairs)
        return value / pairs

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None]:
        (gradient,) = ctx.saved_tensors
        return gradient * gradients[0][..., None, None], None


@lru_cache(maxsize=16)
def _full_offsets(n: int, size_mm: float) -> tuple[tuple[int, int, float], ...]:
    """Every pixel offset of the half annulus: (down, right, weight)."""
    pitch = size_mm / n
    reach = int((PAIR_DISTANCE_MM + PAIR_SPREAD_MM) / pitch)
    offsets = []
    for down in range(reach + 1):
        for right in range(-reach, reach + 1):
            length = pitch * math.hypot(down, right)
            in_half_plane = down > 0 or right > 0
            in_range = abs(length - PAIR_DISTANCE_MM) <= PAIR_SPREAD_MM
            if in_half_plane and in_range and max(down, abs(right)) < n:
                offsets.append((down, right, 1.0 / length))
    return _checked(tuple(offsets), size_mm)


@lru_cache(maxsize=16)
def _polar_offsets(n: int, size_mm: float) -> tuple[tuple[int, int, float], ...]:
    """Midpoint rule in length and angle, at the nearest pixels."""
    pitch = size_mm / n
    offsets = []
    for i in range(QUADRATURE_LENGTHS):
        length = PAIR_DISTANCE_MM + PAIR_SPREAD_MM * ((2 * i + 1) / QUADRATURE_LENGTHS - 1.0)
        for j in range(QUADRATURE_ANGLES):
            angle = math.pi * (j + 0.5) / QUADRATURE_ANGLES
            down, right = round(length * math.sin(angle) / pitch), round(length * math.cos(angle) / pitch)
            if 0 < max(down, abs(right)) < n:
                offsets.append((down, right, 1.0))
    return _checked(tuple(offsets), size_mm)


def _checked(
    offsets: tuple[tuple[int, int, float], ...], size_mm: float
) -> tuple[tuple[int, int, float], ...]:
    widest = PAIR_DISTANCE_MM + PAIR_SPREAD_MM
    if size_mm < widest:
        raise InputError(
            f"size_mm: a patch of {size_mm} mm is smaller than pairs of receptors, {widest:g} mm"
        )
    if not offsets:
        raise InputError(f"size_mm: of {size_mm} mm no two samples lie as near as receptors, {widest:g} mm")
    return offsets


_OFFSETS = {"full": _full_offsets, "polar": _polar_offsets}
