"""Reliefs that the tests press on: float64, mm, over 10 x 10 mm by default."""

import torch
from torch import Tensor

from tactile.contact import Compliance

SIZE = 10.0


def centres(samples: int, size_mm: float = SIZE) -> Tensor:
    """(n,) positions of the pixel centres, from 0 to the size."""
    return (torch.arange(samples, dtype=torch.float64) + 0.5) * size_mm / samples


def waves(samples: int, height: float, seed: int = 0, count: int = 24) -> Tensor:
    """Random plane waves 1.2 to 4 mm long, between 0 and `height`: the same surface at every resolution."""
    random = torch.Generator().manual_seed(seed)
    length, angle, phase = torch.rand(3, count, generator=random, dtype=torch.float64)
    wavenumber = 2.0 * torch.pi / (1.2 + 2.8 * length)
    angle, phase = 2.0 * torch.pi * angle, 2.0 * torch.pi * phase
    x = centres(samples)
    along = x[:, None, None] * torch.sin(angle) + x[None, :, None] * torch.cos(angle)
    field = torch.cos(wavenumber * along + phase).sum(-1)
    return height * (field - field.min()) / (field.max() - field.min())


def grating(samples: int, height: float = 0.6, period: float = 2.0) -> Tensor:
    """Cosine ridges along y, `height` from valley to peak."""
    ridges = 0.5 * height * (1.0 + torch.cos(2.0 * torch.pi * centres(samples) / period))
    return ridges.expand(samples, samples).clone()


def bumps(samples: int, height: float = 0.8, period: float = 2.5, sigma: float = 0.45) -> Tensor:
    """A square grid of Gaussian bumps."""
    middle = period * (torch.arange(round(SIZE / period)) + 0.5)
    row = torch.exp(-0.5 * ((centres(samples)[:, None] - middle) / sigma) ** 2).sum(1)
    return height * row[:, None] * row[None, :]


def manufactured(body: Compliance, mean_pressure: float, samples: int = 32) -> tuple[Tensor, Tensor, Tensor]:
    """A relief manufactured for a prescribed contact, in which no pixel is about to touch or to part.

    Returns:
        Heights (mm), the pressures (units of the body's modulus) that they cause, and the gaps (mm).
    """
    mask = waves(samples, 1.0, seed=3) > 0.5
    pressure = torch.where(mask, 0.5 + waves(samples, 1.0, seed=4), 0.0)
    pressure = pressure * (mean_pressure / pressure.mean())
    gap = torch.where(mask, 0.0, 0.05 + 0.3 * waves(samples, 1.0, seed=6))
    heights = body.displacement(pressure) - gap
    return heights, pressure, gap


EIGHT = tuple((turns, mirrored) for turns in range(4) for mirrored in (False, True))
"""The symmetries of the square: quarter turns, then a mirror image or none."""


def moved(field: Tensor, turns: int, mirrored: bool) -> Tensor:
    """The field after one of the eight symmetries."""
    turned = torch.rot90(field, turns, (-2, -1))
    return turned.flip(-1) if mirrored else turned
