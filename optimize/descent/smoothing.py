"""Steps in a smoothed metric: I + lambda L on a grid, with L the graph Laplacian of the height samples.

A step along (I + lambda L)^-1 of a gradient moves whole hills where the gradient itself moves single samples
(Nicolet, Jacobson and Jakob, "Large Steps in Inverse Rendering of Geometry", 2021). The variable of the
optimiser is u = (I + lambda L)^(1/2) h: gradients and steps are each multiplied by the inverse root. The
paper takes u = (I + lambda L) h, which divides twice. Pictures depend on slopes, so their second derivative
grows like L, and one division makes waves of all lengths converge alike. The cosines of the second kind are
the eigenvectors of L; a product takes two transforms.
"""

import numpy as np
from scipy.fft import dctn, idctn

from relief.ground.arrays import Array


def smoothed(field: Array, weight: float) -> Array:
    """(I + weight L)^(-1/2) times a field (rows, cols); the field itself for weight 0, constants are kept."""
    if weight == 0.0:
        return field
    rows, cols = ((2.0 * np.sin(0.5 * np.pi * np.arange(n) / n)) ** 2 for n in field.shape)
    scaled = dctn(field, norm="ortho") / np.sqrt(1.0 + weight * (rows[:, None] + cols))
    return np.asarray(idctn(scaled, norm="ortho"))
