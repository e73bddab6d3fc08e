"""Shading of a relief under one parallel light, without a renderer, for small pictures."""

import base64
import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from relief.ground.arrays import Array, FloatArray

THUMBNAIL = 128
"""Most pixels a side of the picture of a relief in a notebook."""
SKY_DIRECTIONS = 8
"""Number of directions, evenly all around, in which the horizon is computed."""


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
        softness: Width of the edge of a shadow, relative to the height of the edge above the sample.

    Returns:
        (side, side) from 0 to 1.
    """
    slope = np.tan(np.radians(elevation_deg))
    # Farther away nothing stands high enough for the outer edge of a shadow.
    farthest_mm = np.ptp(heights) / (slope * max(1.0 - 0.5 * softness, 0.1))
    horizon = _horizon(heights, size_mm, azimuth_deg, farthest_mm)
    return np.asarray(np.clip(0.5 + (1.0 - horizon / slope) / softness, 0.0, 1.0))


def open_sky(heights: Array, size_mm: float, farthest_mm: float) -> Array:
    """Share of the light of an even sky that reaches each sample, if the surface there were level.

    Args:
        heights: As for `lit`.
        size_mm: As for `lit`.
        farthest_mm: Distance beyond which the relief is ignored.

    Returns:
        (side, side) from 0 to 1: the mean over `SKY_DIRECTIONS` of the squared cosine of the horizon.
    """
    azimuths = np.arange(SKY_DIRECTIONS) * (360.0 / SKY_DIRECTIONS)
    horizons = (_horizon(heights, size_mm, azimuth, farthest_mm) for azimuth in azimuths)
    return np.asarray(sum(1.0 / (1.0 + horizon**2) for horizon in horizons) / SKY_DIRECTIONS)


def averaged(values: FloatArray, side: int) -> FloatArray:
    """An array (rows, cols) averaged down to at most `side` pixels a side; a smaller one is unchanged."""
    rows, cols = values.shape
    scale = side / max(rows, cols)
    if scale >= 1.0:
        return np.asarray(values, dtype=np.float64)
    target = (max(1, round(cols * scale)), max(1, round(rows * scale)))
    small = Image.fromarray(values.astype(np.float32)).resize(target, Image.Resampling.BOX)
    return np.asarray(small, dtype=np.float64)


def html_picture(heights: Array, pitch_mm: float) -> str:
    """A relief under a lamp at the upper left, 45 degrees up, as an `<img>` that holds its PNG.

    Args:
        heights: (rows, cols) mm, row 0 at +y.
        pitch_mm: distance between neighbouring samples.
    """
    small = averaged(heights, THUMBNAIL)
    side = max(small.shape)
    square = np.pad(small, [(0, side - count) for count in small.shape], mode="edge")
    light = facing(square, pitch_mm * max(heights.shape), 135.0, 45.0)[: small.shape[0], : small.shape[1]]
    file = io.BytesIO()
    Image.fromarray((255.0 * np.clip(light, 0.0, 1.0)).astype(np.uint8)).save(file, "png")
    data = base64.b64encode(file.getvalue()).decode("ascii")
    return f'<img alt="relief under raking light" src="data:image/png;base64,{data}">'


def _horizon(heights: Array, size_mm: float, azimuth_deg: float, farthest_mm: float) -> Array:
    """Tangent (side, side) of the horizon's elevation in one direction, at least 0.

    The way toward the light goes from one row or column to the next, whichever it crosses faster, and between
    two samples there by linear interpolation; nearest samples would tear the edges of shadows.
    """
    side, azimuth = len(heights), np.radians(azimuth_deg)
    toward = np.array([-np.sin(azimuth), np.cos(azimuth)])
    toward /= np.abs(toward).max()
    step_mm = np.hypot(*toward) * size_mm / side
    steps = min(int(farthest_mm / step_mm) + 1, side)
    around = np.pad(heights, steps + 1, constant_values=heights.min())
    horizon = np.zeros_like(heights)
    for step in range(1, steps + 1):
        # Rounded, since a fraction of 1e-16 is rounding.
        place = np.round(step * toward, 9) + steps + 1
        (row, col), (down, right) = np.floor(place).astype(int), np.mod(place, 1.0)
        beyond = (1.0 - down - right) * around[row : row + side, col : col + side]
        if down:
            beyond += down * around[row + 1 : row + 1 + side, col : col + side]
        if right:
            beyond += right * around[row : row + side, col + 1 : col + 1 + side]
        np.maximum(horizon, (beyond - heights) / (step * step_mm), out=horizon)
    return horizon
