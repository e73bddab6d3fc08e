"""Stepped relief: terraces, stairs, blocks."""

import numpy as np

from relief.limits import PATCH_SIDE_MM
from surrogate.families import fields
from surrogate.families.fields import Field


def terraces(rng: np.random.Generator, size: int) -> Field:
    """3 to 9 terraces cut into rolling ground, a slope or a cone; edges 0.08-0.3 of a terrace wide."""
    levels = int(rng.integers(3, 10))
    x, y = fields.coordinates(size)
    grounds = [
        fields.smooth_noise(rng, size, rng.uniform(0.7, 1.8)),
        fields.turned(x, y, rng.uniform(0, np.pi))[0] / 2
        + rng.uniform(0, 0.6) * fields.smooth_noise(rng, size, 1.0),
        np.hypot(x - rng.uniform(-4, 4), y - rng.uniform(-4, 4)) / 2
        + 0.3 * fields.smooth_noise(rng, size, 1.0),
        fields.rough_noise(rng, size, rng.uniform(3.0, 6.0), 2.2),
    ]
    ground = fields.unit(grounds[rng.integers(len(grounds))]) * levels
    edge = rng.uniform(0.08, 0.3)
    floor = np.floor(ground)
    stepped = floor + fields.smoothstep((ground - floor - 1 + edge) / edge)
    return fields.unit(stepped + rng.uniform(0.0, 0.25) * ground)


def blocks(rng: np.random.Generator, size: int) -> Field:
    """Upright blocks of 0.5-5 mm: the plate is cut in two again and again, each part at its own height."""
    smallest = fields.log_uniform(rng, 0.5, 2.0)
    edge = 0.12
    u, v = fields.turned(*fields.coordinates(size), fields.any_direction(rng))
    heights = np.zeros_like(u)
    reach = PATCH_SIDE_MM / np.sqrt(2)
    parts = [(-reach, reach, -reach, reach)]
    while parts:
        left, right, bottom, top = parts.pop()
        wide, tall = right - left, top - bottom
        longer = max(wide, tall)
        if longer > 5.0 or (longer > 2 * smallest and rng.random() < 0.85):
            share = rng.uniform(0.35, 0.65)
            if wide > tall:
                cut = left + share * wide
                parts += [(left, cut, bottom, top), (cut, right, bottom, top)]
            else:
                cut = bottom + share * tall
                parts += [(left, right, bottom, cut), (left, right, cut, top)]
            continue
        inside = np.minimum(np.minimum(u - left, right - u), np.minimum(v - bottom, top - v))
        heights += rng.random() * fields.smoothstep(inside / edge + 0.5)
    return fields.unit(heights)
