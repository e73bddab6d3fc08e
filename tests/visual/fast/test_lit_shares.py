"""Lit shares of triangles, and their derivatives."""

import numpy as np
import pytest
import torch

from visual.fast.lit_shares import positive_share

SIZE, SIDE = 10.0, 32
DOUBLE = torch.float64


def test_shares_are_areas() -> None:
    """Against the share of many points of a triangle where a linear function is positive."""
    values = torch.tensor([[0.3, -0.5, -0.1], [-0.2, 0.6, 0.9], [-1.0, 0.4, 0.1]], dtype=DOUBLE)
    shares, _ = positive_share(values.T)
    count = 1500
    row, col = np.mgrid[:count, :count]
    inside = row + col < count
    u, v = (col[inside] + 1 / 3) / count, (row[inside] + 1 / 3) / count
    for (a, b, c), share in zip(values.numpy(), shares.numpy(), strict=True):
        assert share == pytest.approx(np.mean(a + (b - a) * u + (c - a) * v > 0.0), abs=2e-3)


def test_derivatives_of_shares_are_those_of_small_changes() -> None:
    values = torch.tensor([[0.3, -0.5, -0.1], [-0.2, 0.6, 0.9], [-1.0, 0.4, 0.1]], dtype=DOUBLE).T
    _, by = positive_share(values)
    for corner in range(3):
        change = torch.zeros_like(values)
        change[corner] = 1e-6
        (up, _), (down, _) = positive_share(values + change), positive_share(values - change)
        torch.testing.assert_close(by[corner], (up - down) / 2e-6, rtol=1e-7, atol=1e-9)
