"""Waves that wander and fork: wind ripples on sand, flowing water, wrinkled skin."""

import numpy as np

from surrogate.families.basics import Field, any_direction, log_uniform, rough_noise, turned, unit, wave_field
from surrogate.families.texture_grid import Grid


def ripples(rng: np.random.Generator, grid: Grid) -> Field:
    """Crests 0.7-3 mm apart about a random direction, sharper than the troughs and steeper on one side."""
    period = log_uniform(rng, 0.7, 3.0)
    angle = any_direction(rng)
    order = rng.uniform(0.1, 0.25)
    spread = rng.uniform(0.1, 0.35)
    lean = rng.uniform(-0.6, 0.6)
    sharpness = rng.uniform(1.0, 2.5)
    grain = rng.uniform(0.0, 0.06)

    def amplitude(fx: Field, fy: Field) -> Field:
        along, across = turned(fx, -fy, angle)
        return np.exp(-(((along * period - 1) / order) ** 2) / 2 - (across * period / spread) ** 2 / 2)

    phase = wave_field(rng, grid, amplitude)
    crests = (0.5 + 0.5 * np.cos(phase + lean * np.sin(phase))) ** sharpness
    return unit(crests + grain * rough_noise(rng, grid, 1.0, 1.0))
