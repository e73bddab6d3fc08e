"""Refinement of a relief into quarters of pixels, each of them two triangles that lie on one face each.

A pixel is centred on its height sample, a cell of the mesh lies between four samples (`relief.plate_grid`).
Cut at the middles of the cells, every quarter of a pixel is a square whose diagonal from the upper right to
the lower left parts it into two triangles of equal area.

Shapes: r x c samples and pixels, (r + 1) (c + 1) cells with two faces each, 2r x 2c quarters, and
(2r + 1) (2c + 1) corners of quarters. On an axis that repeats, the ring around the samples is that of the
neighbours.
"""

import torch
from torch import Tensor
from torch.nn import functional

Repeats = tuple[bool, bool]
"""Whether a relief repeats along y and along x."""
ENDS: Repeats = (False, False)


def padded(heights: Tensor, repeats: Repeats = ENDS) -> Tensor:
    """(..., r + 2, c + 2): samples (..., r, c) and a ring of the outermost, or of the neighbours'."""
    down, across = ("circular" if wraps else "replicate" for wraps in repeats)
    whole = heights.reshape(-1, 1, *heights.shape[-2:])
    whole = functional.pad(functional.pad(whole, (1, 1, 0, 0), mode=across), (0, 0, 1, 1), mode=down)
    return whole.view(*heights.shape[:-2], *whole.shape[-2:])


def refined(heights: Tensor, repeats: Repeats = ENDS) -> Tensor:
    """Interpolate a relief at the corners of all quarters of pixels.

    Args:
        heights: (r, c) mm.
        repeats: along y and x.

    Returns:
        (2r + 1, 2c + 1) mm; sample (i, j) stands at (2i + 1, 2j + 1).
    """
    ring, (rows, cols) = padded(heights, repeats), heights.shape
    fine = heights.new_empty(2 * rows + 1, 2 * cols + 1)
    fine[1::2, 1::2] = heights
    fine[0::2, 1::2] = 0.5 * (ring[:-1, 1:-1] + ring[1:, 1:-1])
    fine[1::2, 0::2] = 0.5 * (ring[1:-1, :-1] + ring[1:-1, 1:])
    fine[0::2, 0::2] = 0.5 * (ring[:-1, 1:] + ring[1:, :-1])
    return fine


def face_slopes(heights: Tensor, size_mm: float, repeats: Repeats = ENDS) -> tuple[Tensor, Tensor]:
    """Slopes dz/dx and dz/dy of all faces.

    Args:
        heights: (r, c) mm.
        size_mm: width of the plate.
        repeats: along y and x.

    Returns:
        Two (2, r + 1, c + 1): of the upper left and of the lower right face of every cell.
    """
    ring, spacing = padded(heights, repeats), size_mm / heights.shape[1]
    right = (ring[:, 1:] - ring[:, :-1]) / spacing
    up = (ring[:-1, :] - ring[1:, :]) / spacing
    return torch.stack((right[:-1], right[1:])), torch.stack((up[:, :-1], up[:, 1:]))


def on_triangles(faces: Tensor) -> Tensor:
    """Values of faces (..., 2, r + 1, c + 1) on their triangles (..., 2, 2r, 2c), upper left ones first."""
    first, second = faces.unbind(-3)
    fine = faces.new_empty(*faces.shape[:-2], *(2 * (n - 1) for n in faces.shape[-2:]))
    fine[..., 0::2, 0::2] = second[..., None, :-1, :-1]
    fine[..., 0, 0::2, 1::2] = first[..., :-1, 1:]
    fine[..., 1, 0::2, 1::2] = second[..., :-1, 1:]
    fine[..., 0, 1::2, 0::2] = first[..., 1:, :-1]
    fine[..., 1, 1::2, 0::2] = second[..., 1:, :-1]
    fine[..., 1::2, 1::2] = first[..., None, 1:, 1:]
    return fine


def on_quarters(pixels: Tensor) -> Tensor:
    """Values of pixels (r, c) on their quarters (2r, 2c)."""
    return pixels.repeat_interleave(2, 0).repeat_interleave(2, 1)


def quarter_means(triangles: Tensor) -> Tensor:
    """Means (..., 2r, 2c) of the two triangles (..., 2, 2r, 2c) of each quarter."""
    return triangles.mean(-3)


def pixel_means(quarters: Tensor) -> Tensor:
    """Means (..., r, c) of the four quarters (..., 2r, 2c) of each pixel."""
    rows, cols = (n // 2 for n in quarters.shape[-2:])
    return quarters.view(*quarters.shape[:-2], rows, 2, cols, 2).mean((-3, -1))
