"""The sRGB curve (IEC 61966-2-1): from linear values to those that a screen shows, and back."""

import numpy as np

from relief.ground.arrays import FloatArray


def srgb(radiance: FloatArray, white: float) -> FloatArray:
    """Values in [0, 1] that a screen shows as the radiance.

    Args:
        radiance: linear, of any shape.
        white: radiance shown as full white; brighter radiance is clipped.
    """
    linear = np.clip(radiance / white, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)


def linear_rgb(shown: FloatArray) -> FloatArray:
    """Linear values in [0, 1] of values that a screen shows, of any shape, the inverse of `srgb`."""
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
