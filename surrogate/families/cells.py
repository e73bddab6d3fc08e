"""Grounds that fall into cells: leather, cracked mud."""

import numpy as np

from surrogate.families import fields
from surrogate.families.fields import Field


def leather(rng: np.random.Generator, size: int) -> Field:
    """Cushions 0.5-2 mm wide with soft furrows between them, on the swell and the creases of a hide."""
    spacing = fields.log_uniform(rng, 0.5, 2.0)
    x, y = fields.coordinates(size)
    bend = spacing * rng.uniform(0.02, 0.1)
    x = (x + bend * fields.smooth_noise(rng, size, 0.8 * spacing)) / rng.uniform(1.0, 1.6)
    y = y + bend * fields.smooth_noise(rng, size, 0.8 * spacing)
    points = fields.scattered(rng, spacing, rng.uniform(0.35, 0.6))
    distance, cell = fields.border_distance(points, x, y)
    cushions = fields.dome(1 - np.minimum(distance / (spacing * rng.uniform(0.2, 0.45)), 1.0))
    tall = rng.uniform(0.75, 1.0, len(points))[cell]
    creases, _ = fields.border_distance(fields.scattered(rng, spacing * rng.uniform(3, 5), 0.5), x, y)
    creased = fields.smoothstep(0.35 + creases / (0.5 * spacing))
    swell = rng.uniform(0.02, 0.15) * fields.smooth_noise(rng, size, rng.uniform(1.0, 2.0))
    return fields.unit(
        cushions * tall * creased + swell + rng.uniform(0.0, 0.04) * fields.rough_noise(rng, size, 0.6, 1.0)
    )


def cracked(rng: np.random.Generator, size: int) -> Field:
    """Plates 1.2-4 mm wide that shrank apart: steep cracks, curled rims, finer cracks in the plates."""
    spacing = fields.log_uniform(rng, 1.2, 4.0)
    crack = rng.uniform(0.1, 0.3)
    x, y = fields.coordinates(size)
    bend = spacing * rng.uniform(0.02, 0.06)
    x = x + bend * fields.rough_noise(rng, size, spacing, 1.8)
    y = y + bend * fields.rough_noise(rng, size, spacing, 1.8)
    points = fields.scattered(rng, spacing, rng.uniform(0.35, 0.6))
    distance, cell = fields.border_distance(points, x, y)
    plate = points[cell]
    tilt = rng.normal(0.0, rng.uniform(0.0, 0.12) / spacing, points.shape)[cell]
    tilted = tilt[..., 0] * (x - plate[..., 0]) + tilt[..., 1] * (y - plate[..., 1])
    curl = rng.uniform(0.0, 0.3) * np.exp(-distance / (0.2 * spacing))
    finer, _ = fields.border_distance(fields.scattered(rng, spacing / rng.uniform(2.0, 3.0), 0.5), x, y)
    hairlines = rng.uniform(0.0, 0.2) * (1 - fields.smoothstep(finer / (0.5 * crack + 0.08)))
    grain = rng.uniform(0.0, 0.03) * fields.rough_noise(rng, size, 1.0, 1.2)
    level = 1 + tilted + curl - hairlines + grain
    return fields.unit(level * fields.smoothstep((distance - crack / 4) / (crack + 0.08)))
