"""Shading of a relief under one parallel light, for small pictures; nothing is rendered."""

import numpy as np
from numpy.typing import NDArray

from relief.common.arrays import Array

SHADOW_STRIDE = 2
"""Samples from one look toward the light to the next."""


def facing(heights: NDArray[np.floating], size_mm: float, azimuth_deg: float, elevation_deg: float) -> Array:
    """Cosine of the angle between the surface's normal and the light.

    Args:
        heights: (rows, cols) mm, row 0 at +y.
        size_mm: Length of both sides, mm.
        azimuth_deg: Direction toward the light, counter-clockwise from +x.
        elevation_deg: Height of the light above the plate.

    Returns:
        (rows, cols), negative for faces that are turned away.
    """
    pitches = [size_mm / count for count in heights.shape]
    down, right = (
        np.gradient(heights.astype(np.float64), pitch, axis=axis)
        if heights.shape[axis] > 1
        else np.zeros_like(heights)
        for axis, pitch in enumerate(pitches)
    )
    azimuth, elevation = np.radians([azimuth_deg, elevation_deg])
    toward = np.sin(elevation) - np.cos(elevation) * (np.cos(azimuth) * right - np.sin(azimuth) * down)
    return np.asarray(toward / np.sqrt(1.0 + down**2 + right**2))


def lit(heights: Array, size_mm: float, azimuth_deg: float, elevation_deg: float, softness: float) -> Array:
    """Share of the light that reaches each sample past the rest of the relief.

    Args:
        heights: (side, side) mm, row 0 at +y; the relief ends at its rim.
        size_mm: Length of a side, mm.
        azimuth_deg: As for `facing`.
        elevation_deg: As for `facing`, above 0.
        softness: Width of the edge of a shadow, as a part of how far above the sample its edge stands.

    Returns:
        (side, side) from 0 to 1.
    """
    rise = np.tan(np.radians(elevation_deg)) * size_mm / len(heights)
    toward = np.array([-np.sin(np.radians(azimuth_deg)), np.cos(np.radians(azimuth_deg))])
    share = np.ones_like(heights)
    farthest = min(int(np.ptp(heights) / rise) + 1, len(heights))
    around = np.pad(heights, farthest + 1, constant_values=heights.min())
    for distance in range(SHADOW_STRIDE, farthest + 1, SHADOW_STRIDE):
        row, col = np.rint(distance * toward).astype(int) + farthest + 1
        beyond = around[row : row + len(heights), col : col + len(heights)]
        clear = (heights + distance * rise - beyond) / (softness * distance * rise)
        share = np.minimum(share, np.clip(0.5 + clear, 0.0, 1.0))
    return share
