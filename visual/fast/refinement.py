"""Refinement of a relief into quarters of pixels, each of them two triangles that lie on one face each.

A pixel is centred on its height sample, a cell of the mesh lies between four samples (`relief.grid`). Cut at
the middles of the cells, every quarter of a pixel is a square whose diagonal from the upper right to the
lower left parts it into two triangles of equal area.

Shapes: n x n samples and pixels, (n + 1)² cells with two faces each, 2n x 2n quarters, (2n + 1)² corners of
quarters.
"""

import torch
from torch import Tensor
from torch.nn import functional


def padded(heights: Tensor) -> Tensor:
    """(n + 2, n + 2) heights of the mesh's vertices: samples (n, n) and a ring that repeats the outermost."""
    return functional.pad(heights[None, None], (1, 1, 1, 1), mode="replicate")[0, 0]


def refined(heights: Tensor) -> Tensor:
    """Interpolate a relief at the corners of all quarters of pixels.

    Args:
        heights: (n, n) mm.

    Returns:
        (2n + 1, 2n + 1) mm; sample (i, j) stands at (2i + 1, 2j + 1).
    """
    ring, n = padded(heights), heights.shape[0]
    fine = heights.new_empty(2 * n + 1, 2 * n + 1)
    fine[1::2, 1::2] = heights
    fine[0::2, 1::2] = 0.5 * (ring[:-1, 1:-1] + ring[1:, 1:-1])
    fine[1::2, 0::2] = 0.5 * (ring[1:-1, :-1] + ring[1:-1, 1:])
    fine[0::2, 0::2] = 0.5 * (ring[:-1, 1:] + ring[1:, :-1])
    return fine


def face_slopes(heights: Tensor, size_mm: float) -> tuple[Tensor, Tensor]:
    """Slopes dz/dx and dz/dy of all faces.

    Args:
        heights: (n, n) mm.
        size_mm: side of the plate.

    Returns:
        Two (2, n + 1, n + 1): of the upper left and of the lower right face of every cell.
    """
    ring, spacing = padded(heights), size_mm / heights.shape[0]
    right = (ring[:, 1:] - ring[:, :-1]) / spacing
    up = (ring[:-1, :] - ring[1:, :]) / spacing
    return torch.stack((right[:-1], right[1:])), torch.stack((up[:, :-1], up[:, 1:]))


def on_triangles(faces: Tensor) -> Tensor:
    """Values of faces (..., 2, n + 1, n + 1) on their triangles (..., 2, 2n, 2n), upper left ones first."""
    n = faces.shape[-1] - 1
    first, second = faces.unbind(-3)
    fine = faces.new_empty(*faces.shape[:-2], 2 * n, 2 * n)
    fine[..., 0::2, 0::2] = second[..., None, :-1, :-1]
    fine[..., 0, 0::2, 1::2] = first[..., :-1, 1:]
    fine[..., 1, 0::2, 1::2] = second[..., :-1, 1:]
    fine[..., 0, 1::2, 0::2] = first[..., 1:, :-1]
    fine[..., 1, 1::2, 0::2] = second[..., 1:, :-1]
    fine[..., 1::2, 1::2] = first[..., None, 1:, 1:]
    return fine


def on_quarters(pixels: Tensor) -> Tensor:
    """Values of pixels (n, n) on their quarters (2n, 2n)."""
    return pixels.repeat_interleave(2, 0).repeat_interleave(2, 1)


def quarter_means(triangles: Tensor) -> Tensor:
    """Means (..., 2n, 2n) of the two triangles (..., 2, 2n, 2n) of each quarter."""
    return triangles.mean(-3)


def pixel_means(quarters: Tensor) -> Tensor:
    """Means (..., n, n) of the four quarters (..., 2n, 2n) of each pixel."""
    side = quarters.shape[-1] // 2
    return quarters.view(*quarters.shape[:-2], side, 2, side, 2).mean((-3, -1))
