"""The eight symmetries of the square, under which touch and sight are exactly alike."""

from __future__ import annotations

import torch
from torch import Tensor

SYMMETRIES = 8
"""Quarter turns, and then a mirror image or none."""


def transformed(field: Tensor, symmetry: int) -> Tensor:
    """Maps (..., n, n) after a symmetry of the square.

    Args:
        symmetry: 0 to 7: so many quarter turns counterclockwise, and from 4 on then left and right exchanged.
    """
    turned = torch.rot90(field, symmetry % 4, (-2, -1))
    return turned.flip(-1) if symmetry >= 4 else turned


def transformed_vectors(vectors: Tensor, symmetry: int) -> Tensor:
    """Vectors (..., 3) after the same symmetry: x to the right, y up in the maps, z out of them."""
    x, y, z = vectors.unbind(-1)
    for _ in range(symmetry % 4):
        x, y = -y, x
    return torch.stack((-x if symmetry >= 4 else x, y, z), dim=-1)
