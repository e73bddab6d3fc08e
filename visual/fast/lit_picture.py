"""Picture of a relief under one light as a torch function: lit shares times radiance, with exact gradients.

    picture of a pixel = sum over its eight triangles of  1/8 * lit share * radiance of the face

The gradient follows the shadow's boundary: only triangles that the boundary crosses contribute.
"""

from functools import lru_cache
from typing import Any

import numpy as np
import torch
from torch import Tensor

from visual.fast.lit_shares import lit_shares
from visual.fast.refinement import on_triangles
from visual.fast.shadow_sweep import ShadowSweep


def lit_picture(fine: Tensor, faces: Tensor, sweep: ShadowSweep | None) -> Tensor:
    """Picture under one light, shadows included, differentiable by heights and radiance.

    Args:
        fine: (2r + 1, 2c + 1) mm, heights of `refined`.
        faces: (2, r + 1, c + 1) radiance of the faces where they are lit.
        sweep: of the light; None for a light that casts no shadow.

    Returns:
        (r, c) radiance.
    """
    if sweep is None:
        return pooled_faces(None, faces)
    picture: Tensor = _LitPicture.apply(fine, faces, sweep)
    return picture


def lit_share(fine: Tensor, sweep: ShadowSweep | None) -> Tensor | None:
    """Lit shares (2, 2r, 2c) of triangles, differentiable by heights; None where all are 1.

    Args:
        fine: (2r + 1, 2c + 1) mm, heights of `refined`.
        sweep: of the light; None for a light that casts no shadow.
    """
    if sweep is None:
        return None
    shares: Tensor = _LitShare.apply(fine, sweep)
    return shares


class _LitShare(torch.autograd.Function):
    """`lit_share` with its derivative in closed form."""

    @staticmethod
    def forward(ctx: Any, fine: Tensor, sweep: ShadowSweep) -> Tensor:
        clearance, ctx.highest_column = sweep.trace(fine)
        shares, ctx.boundary = lit_shares(clearance)
        ctx.sweep = sweep
        return shares

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None]:
        weight = gradient.reshape(-1).index_select(0, ctx.boundary.triangle)
        return _to_fine(ctx, weight, (gradient.shape[-2] + 1, gradient.shape[-1] + 1)), None


def _to_fine(ctx: Any, weight: Tensor, shape: tuple[int, int]) -> Tensor:
    """The gradient by heights of this shape, from that by the shares of the boundary's triangles."""
    to_fine = weight.new_zeros(shape[0] * shape[1] + 1)
    to_fine.index_add_(0, ctx.boundary.corners.view(-1), (weight * ctx.boundary.by_clearance).view(-1))
    corners = torch.from_numpy(np.flatnonzero(to_fine.numpy()))
    occluders, weights = ctx.sweep.occluders(ctx.highest_column, corners)
    taken = weights * to_fine.index_select(0, corners)
    to_fine.index_add_(0, occluders.view(-1), taken.view(-1), alpha=-1)
    return to_fine[:-1].view(shape)


class _LitPicture(torch.autograd.Function):
    """`lit_picture` with its derivative in closed form."""

    @staticmethod
    def forward(ctx: Any, fine: Tensor, faces: Tensor, sweep: ShadowSweep) -> Tensor:
        clearance, highest_column = sweep.trace(fine)
        shares, boundary = lit_shares(clearance)
        ctx.sweep, ctx.highest_column, ctx.boundary = sweep, highest_column, boundary
        ctx.save_for_backward(shares, faces)
        return pooled_faces(shares, faces)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        shares, faces = ctx.saved_tensors
        to_fine = to_faces = None
        if ctx.needs_input_grad[1]:
            to_faces = _pooled_faces_adjoint(shares, gradient)
        if ctx.needs_input_grad[0]:
            triangle, (rows, cols) = ctx.boundary.triangle, gradient.shape
            pixel, face = (numbers.index_select(0, triangle) for numbers in _triangle_numbers(rows, cols))
            weight = 0.125 * gradient.reshape(-1).index_select(0, pixel)
            weight = weight * faces.reshape(-1).index_select(0, face)
            to_fine = _to_fine(ctx, weight, (2 * rows + 1, 2 * cols + 1))
        return to_fine, to_faces, None


def pooled_faces(shares: Tensor | None, faces: Tensor) -> Tensor:
    """Mean over the triangles of each pixel of lit share times radiance.

    Args:
        shares: (2, 2r, 2c) of triangles of quarters; None where all are 1.
        faces: (2, r + 1, c + 1) radiance.

    Returns:
        (r, c) radiance.
    """
    own = _own_faces(faces)
    if shares is None:
        return 0.125 * (2.0 * (own[0] + own[5]) + own[1] + own[2] + own[3] + own[4])
    first, *others = (share * face for share, face in zip(_pooled_shares(shares), own, strict=True))
    return 0.125 * sum(others, first)


def _pooled_faces_adjoint(shares: Tensor, gradient: Tensor) -> Tensor:
    """(2, r + 1, c + 1): the transpose of `pooled_faces` with respect to its faces."""
    gradient = 0.125 * gradient
    both = gradient.new_zeros(2, *(n + 1 for n in gradient.shape))
    for share, face in zip(_pooled_shares(shares), _own_faces(both), strict=True):
        face.addcmul_(share, gradient)
    return both


def _own_faces(faces: Tensor) -> tuple[Tensor, ...]:
    """(r, c) views of the six faces in each pixel: first and last fill a quarter, the others half of one."""
    first, second = faces
    return second[:-1, :-1], first[:-1, 1:], second[:-1, 1:], first[1:, :-1], second[1:, :-1], first[1:, 1:]


def _pooled_shares(shares: Tensor) -> tuple[Tensor, ...]:
    """(r, c) shares of the six faces of `_own_faces`."""
    one, two = shares
    return (
        one[0::2, 0::2] + two[0::2, 0::2],
        one[0::2, 1::2],
        two[0::2, 1::2],
        one[1::2, 0::2],
        two[1::2, 0::2],
        one[1::2, 1::2] + two[1::2, 1::2],
    )


@lru_cache(maxsize=4)
def _triangle_numbers(rows: int, cols: int) -> tuple[Tensor, Tensor]:
    """(8 rows cols,) flat numbers of the pixel and of the face of every triangle of `lit_shares`."""
    row, col = (torch.arange(2 * n).div(2, rounding_mode="floor") for n in (rows, cols))
    pixel = (row[:, None] * cols + col).expand(2, 2 * rows, 2 * cols)
    face = on_triangles(torch.arange(2 * (rows + 1) * (cols + 1)).view(2, rows + 1, cols + 1))
    return pixel.reshape(-1), face.reshape(-1)
