"""Visual masking: weights of pixels by local contrast, as contrast masks changes."""

import numpy as np
from scipy.ndimage import gaussian_filter

from relief.ground.arrays import Array

RADIUS = 6.0
"""Standard deviation of the window of local contrast, pixels of a step's pictures: 0.23 mm in the studio."""
LEAST_LEVEL = 0.1
"""Share of the mean picture that is added to the local mean: deep shadow has no contrast that masks."""


def masking_weights(pictures: Array, strength: float, periodic: tuple[bool, bool] = (False, False)) -> Array:
    """Weights 1 / (1 + strength * contrast / mean contrast), with mean 1 over each picture.

    The contrast is the local standard deviation over the local mean.

    Args:
        pictures: (conditions, rows, cols) to keep.
        strength: not negative; 0 gives ones.
        periodic: whether pictures repeat along rows and along columns.

    Returns:
        (conditions, rows, cols).
    """
    return np.stack([_weights(picture, strength, periodic) for picture in pictures])


def _weights(picture: Array, strength: float, periodic: tuple[bool, bool]) -> Array:
    if not picture.any():
        return np.ones_like(picture)  # black, as under a light from below
    ends = ["wrap" if wraps else "nearest" for wraps in periodic]
    mean = gaussian_filter(picture, RADIUS, mode=ends)
    spread = np.sqrt(gaussian_filter(np.square(picture - mean), RADIUS, mode=ends))
    contrast = spread / (mean + LEAST_LEVEL * picture.mean())
    if contrast.mean() == 0.0:
        return np.ones_like(picture)
    weights = 1.0 / (1.0 + strength * contrast / contrast.mean())
    return np.asarray(weights / weights.mean())
