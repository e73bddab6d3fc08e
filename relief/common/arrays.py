"""Arrays: the types that most modules name, and the smooth step."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
"""Array in double precision, the precision of everything that is measured."""
Index = NDArray[np.int64]
"""Array of numbers of things: faces, vertices, pixels, height samples."""
FloatArray = NDArray[np.floating[Any]]
"""Array of floating-point numbers of any precision."""
AnyArray = NDArray[Any]
"""Array of any type."""


def smooth_step(t: ArrayLike) -> Array:
    """0 below 0, 1 above 1, and between them a cubic with flat ends."""
    t = np.clip(np.asarray(t, dtype=np.float64), 0.0, 1.0)
    return np.asarray(t * t * (3.0 - 2.0 * t))
