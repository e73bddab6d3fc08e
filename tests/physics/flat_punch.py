"""A rigid flat circular punch on an elastic half-space.

Boussinesq, Application des potentiels (1885); Johnson, Contact Mechanics, section 3.8.

Symbols: F force (N), a radius of the punch (mm), E* = E / (1 - nu²) (MPa).
"""

import math

from torch import Tensor


def approach(force: float, radius: float, modulus: float) -> float:
    """d = F / (2 E* a), mm."""
    return force / (2.0 * modulus * radius)


def pressure(distance: Tensor, force: float, radius: float) -> Tensor:
    """p(r) = F / (2 pi a²) / sqrt(1 - r²/a²), MPa, for r < a."""
    return force / (2.0 * math.pi * radius**2) / (1.0 - (distance / radius) ** 2).sqrt()
