"""A rigid sinusoid on an elastic half-space.

Westergaard, J. Appl. Mech. 6 (1939); Johnson, Contact Mechanics, section 13.2.

Symbols: h(x) = D cos(2 pi x / l) the profile, D amplitude (mm), l wavelength (mm), E* = E / (1 - nu²) (MPa).
"""

import math

import torch
from torch import Tensor


def full_contact_pressure(amplitude: float, wavelength: float, modulus: float) -> float:
    """Mean pressure at which the contact closes: p* = pi E* D / l, MPa."""
    return math.pi * modulus * amplitude / wavelength


def contact_fraction(mean_pressure: float, closing_pressure: float) -> float:
    """Share of the wavelength in contact, 2a/l, from p/p* = sin²(pi a / l)."""
    return 2.0 / math.pi * math.asin(math.sqrt(mean_pressure / closing_pressure))


def pressure(x: Tensor, mean_pressure: float, closing_pressure: float, wavelength: float) -> Tensor:
    """p(x) = 2 p* cos(psi) sqrt(sin²(psi_a) - sin²(psi)), psi = pi x / l; MPa, zero outside the contact."""
    psi = math.pi * x / wavelength
    inside = (mean_pressure / closing_pressure - torch.sin(psi) ** 2).clamp_min(0.0)
    return 2.0 * closing_pressure * torch.cos(psi).abs() * inside.sqrt()
