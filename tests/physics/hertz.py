"""A rigid sphere on an elastic half-space.

Hertz, J. reine angew. Math. 92 (1881); Johnson, Contact Mechanics, section 4.2.

Symbols: F force (N), R radius (mm), E* = E / (1 - nu²) plane-strain modulus (MPa).
"""

import math


def contact_radius(force: float, radius: float, modulus: float) -> float:
    """a = (3 F R / 4 E*)^(1/3), mm."""
    return (3.0 * force * radius / (4.0 * modulus)) ** (1.0 / 3.0)


def approach(force: float, radius: float, modulus: float) -> float:
    """Displacement of the sphere against the far half-space: a² / R, mm."""
    return contact_radius(force, radius, modulus) ** 2 / radius


def peak_pressure(force: float, radius: float, modulus: float) -> float:
    """p0 = (6 F E*² / pi³ R²)^(1/3), MPa; p(r) = p0 sqrt(1 - r²/a²)."""
    return (6.0 * force * modulus**2 / (math.pi**3 * radius**2)) ** (1.0 / 3.0)
