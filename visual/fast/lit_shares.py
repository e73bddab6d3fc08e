"""Lit shares of triangles, from the clearance at their corners, with derivatives.

Clearance is linear on a triangle, so the boundary of a shadow is a straight line through the triangle. The
share of the area on the positive side is continuous in the clearances, and so is the lit share of a pixel.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import torch
from torch import Tensor

from relief.ground.arrays import Index

ALL_LIT = 7
"""Code of a triangle whose three corners are lit, one bit each."""


@dataclass(frozen=True, eq=False)
class BoundaryTriangles:
    """Triangles of quarters of pixels that the boundary of a shadow crosses.

    Attributes:
        triangle: (k,) flat numbers in (2, p - 1, q - 1): upper left triangles of all quarters, then lower
            right ones.
        corners: (3, k) flat numbers in (p, q): first the corner that is alone on its side of the boundary.
        share: (k,) lit share of the triangle.
        by_clearance: (3, k) derivative of `share` by the clearance of the corners, 1/mm.
    """

    triangle: Tensor
    corners: Tensor
    share: Tensor
    by_clearance: Tensor


def lit_shares(clearance: Tensor) -> tuple[Tensor, BoundaryTriangles]:
    """Lit shares of all triangles of quarters of pixels.

    Args:
        clearance: (p, q) mm, of the corners of quarters.

    Returns:
        Shares (2, p - 1, q - 1) in [0, 1], and the triangles at which they lie strictly between.
    """
    down, across = clearance.shape
    above = (clearance > 0.0).numpy().view(np.uint8)
    # Which of its three corners are lit, as the bits of a number.
    code = np.stack((above[:-1, :-1], above[1:, 1:]))
    code += 2 * above[:-1, 1:]
    code += 4 * above[1:, :-1]
    triangle = np.flatnonzero((code - 1) < ALL_LIT - 1)
    kind = code.reshape(-1).take(triangle) + 8 * (triangle >= (down - 1) * (across - 1))
    corners = torch.from_numpy(
        _first_corners(down, across).take(triangle) + _steps_to_corners(across).take(kind, axis=1)
    )
    values = clearance.reshape(-1).index_select(0, corners.view(-1)).view(corners.shape)
    share, by_clearance = positive_share(values)
    number = torch.from_numpy(triangle)
    shares = torch.from_numpy(code == ALL_LIT).to(clearance.dtype)
    shares.view(-1).index_copy_(0, number, share)
    return shares, BoundaryTriangles(number, corners, share, by_clearance)


@lru_cache(maxsize=4)
def _first_corners(down: int, across: int) -> Index:
    """(triangles,) upper left corner of the quarter of every triangle, as flat numbers in (down, across)."""
    corner = np.arange(down * across).reshape(down, across)[:-1, :-1]
    return np.tile(corner.ravel(), 2)


@lru_cache(maxsize=4)
def _steps_to_corners(across: int) -> Index:
    """(3, 16) flat steps from the upper left corner of a quarter to the corners of `BoundaryTriangles`.

    By the code of the lit corners; those of lower right triangles from 8 on.
    """
    alone = {1: 0, 6: 0, 2: 1, 5: 1, 4: 2, 3: 2}
    steps = np.zeros((3, 16), dtype=np.int64)
    for which, own in enumerate((0, across + 1)):
        corners = (own, 1, across)
        for code, odd in alone.items():
            steps[:, code + 8 * which] = corners[odd], corners[odd - 2], corners[odd - 1]
    return steps


def positive_share(values: Tensor) -> tuple[Tensor, Tensor]:
    """Shares of triangles on which a linear function is positive, and their derivatives.

    With value a at the corner that is alone on its side, b and c at the others, the part at that corner is
    the share a² / ((a - b) (a - c)).

    Args:
        values: (3, k) of the function at the corners; the first has the opposite sign of both others.

    Returns:
        Shares (k,) and (3, k) their derivatives by `values`.
    """
    odd, left, right = values
    to_left, to_right = odd - left, odd - right
    small = (odd / to_left) * (odd / to_right)
    by_left, by_right = small / to_left, small / to_right
    by_odd = 2.0 * odd / (to_left * to_right) - by_left - by_right
    sign = (odd > 0.0).to(odd.dtype).mul_(2.0).sub_(1.0)
    return (0.5 - 0.5 * sign) + sign * small, sign * torch.stack((by_odd, by_left, by_right))
