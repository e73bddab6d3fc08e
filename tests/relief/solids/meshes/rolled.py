"""Tiles rolled around a cylinder, which keeps every length on it."""

import numpy as np

from relief.solids.body import Body


def rolled(heights: np.ndarray, size_mm: float, around: int, high: int) -> tuple[Body, Body]:
    """A tube of tiles, and the smooth tube under them, both closed by flat ends.

    Args:
        heights: (n, n) mm of a tile.
        size_mm: Its side.
        around: Tiles around the tube, whose radius follows.
        high: Tiles along the tube.
    """
    n = len(heights)
    radius = around * size_mm / (2.0 * np.pi)
    step = max(1, n // 16)
    textured = _tube(np.tile(heights, (high, around)), radius, size_mm / n)
    return textured, _tube(np.zeros((high * n // step, around * n // step)), radius, size_mm * step / n)


def _tube(heights: np.ndarray, radius: float, pitch: float) -> Body:
    rows, cols = heights.shape
    angle = np.arange(cols) * 2.0 * np.pi / cols
    z = (np.arange(rows)[::-1, None] + 0.5) * pitch
    distance = radius + heights
    points = [distance * np.cos(angle), distance * np.sin(angle), np.broadcast_to(z, heights.shape)]
    ends = [[0.0, 0.0, z[0, 0]], [0.0, 0.0, z[-1, 0]]]
    index = np.arange(rows * cols).reshape(rows, cols)
    a, b = index[:-1].ravel(), np.roll(index, -1, axis=1)[:-1].ravel()
    c, d = index[1:].ravel(), np.roll(index, -1, axis=1)[1:].ravel()
    top, bottom = index[0], index[-1]
    middle = np.full(cols, rows * cols)
    faces = [
        *(np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)),
        np.stack([middle, top, np.roll(top, -1)], axis=-1),
        np.stack([middle + 1, np.roll(bottom, -1), bottom], axis=-1),
    ]
    return Body(np.concatenate([np.stack(points, axis=-1).reshape(-1, 3), ends]), np.concatenate(faces))
