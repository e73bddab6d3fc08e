"""Symmetries of the square, all eight of which leave touch and sight exactly as they are."""

import torch
from torch import Tensor

SYMMETRIES = 8
"""Number of the symmetries: four quarter turns, each with a mirror image and without."""


def transformed(field: Tensor, symmetry: int) -> Tensor:
    """Apply a symmetry of the square to maps.

    Args:
        field: (..., n, n) maps.
        symmetry: 0 to 7: number of quarter turns counter-clockwise, modulo 4; from 4 on left and right are
            exchanged afterwards.

    Returns:
        The transformed maps.
    """
    turned = torch.rot90(field, symmetry % 4, (-2, -1))
    return turned.flip(-1) if symmetry >= 4 else turned
