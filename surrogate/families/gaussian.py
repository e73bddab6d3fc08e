"""Gaussian random relief: cast plaster, sandblasted metal, orange peel, hills."""

import numpy as np

from surrogate.families.basics import Field, any_direction, gaussian_field, log_uniform, turned, unit
from surrogate.families.texture_grid import Grid

_FINEST_MM = 0.06
"""Blur (standard deviation) that keeps features above 0.3 mm, the least that a pitch of 0.08 mm resolves."""


def gaussian(rng: np.random.Generator, grid: Grid) -> Field:
    """A Gaussian field whose spectrum is flat above a corner wavelength of 0.6-4 mm and falls below it.

    The fall of amplitude has a slope of 1.5 (rough at every scale) to 5 (smooth hills). Half of the fields
    are stretched 1.5-6 times along a random direction.
    """
    corner = log_uniform(rng, 0.6, 4.0)
    slope = rng.uniform(1.5, 5.0)
    stretch = log_uniform(rng, 1.5, 6.0) if rng.random() < 0.5 else 1.0
    angle = any_direction(rng)

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = turned(fx, -fy, angle)
        squared = (along * stretch) ** 2 + across**2
        cut = np.exp(-2 * (np.pi * _FINEST_MM) ** 2 * (fx**2 + fy**2))
        return (1 + corner**2 * squared) ** (-slope / 2) * cut

    return unit(gaussian_field(rng, grid, amplitude))
