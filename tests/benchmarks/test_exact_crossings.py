"""Triangles cross exactly where they meet in more than a point."""

import numpy as np
import pytest

from benchmarks.objects.parts.exact_crossings import cross_exactly

FLAT = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], np.float32)


@pytest.mark.parametrize(
    ("other", "crosses"),
    [
        ([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [0.4, 0.2, 1.0]], True),
        ([[0.2, 0.2, -1e-30], [0.2, 0.2, 1.0], [0.4, 0.2, 1.0]], True),
        ([[0.2, 0.2, 0.0], [0.2, 0.2, 1.0], [0.4, 0.2, 1.0]], False),
        ([[2.0, 0.2, -1.0], [2.0, 0.2, 1.0], [3.0, 0.2, 1.0]], False),
        ([[0.0, 0.0, 0.0], [0.5, 0.5, 1.0], [0.5, 0.5, -1.0]], True),
        ([[0.0, 0.0, 0.0], [-0.5, 0.5, 1.0], [-0.5, 0.5, -1.0]], False),
        ([[0.2, 0.2, 0.0], [0.5, 0.2, 0.0], [0.2, 0.5, 0.0]], False),
        ([[0.2, 0.2, 1e-30], [0.5, 0.2, 1e-30], [0.2, 0.5, 1e-30]], False),
    ],
    ids=["through", "barely", "onto", "beside", "at a corner", "away from a corner", "in one plane", "above"],
)
def test_triangles_cross(other, crosses) -> None:
    second = np.array(other)
    assert cross_exactly(FLAT, second) == cross_exactly(second, FLAT) == crosses
