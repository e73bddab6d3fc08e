"""Pressing sets of reliefs by any model of touch: V and contact area, and how far they are from a truth."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor

import tactile
from benchmarks.touch.pressed_reliefs import SIZE_MM
from relief.ground.arrays import Array
from tactile.contact import solve_contact
from tactile.model import SkinOperator
from tactile.strain import smallest_eigenvalue

SKIN = tactile.Skin()
MEAN = SKIN.mean_pressure_mpa(SIZE_MM) / SKIN.young_modulus_mpa
BATCH = 8


class Measured(NamedTuple):
    """V and contact area (mm²) of each relief of a set."""

    roughness: Array
    area: Array


def measure(operator: SkinOperator, reliefs: Tensor) -> Measured:
    """Press on reliefs (count, n, n), in batches."""
    flat = smallest_eigenvalue(
        operator.strain(solve_contact(operator, torch.zeros_like(reliefs[0]), MEAN).pressure)
    )
    rows = []
    for batch in reliefs.split(BATCH):
        state = solve_contact(operator, batch, MEAN)
        strain = smallest_eigenvalue(operator.strain(state.pressure)) - flat
        rows.append((tactile.roughness(strain, SIZE_MM), tactile.contact_area(state.gap, SIZE_MM)))
    return Measured(*(torch.cat(parts).numpy() for parts in zip(*rows, strict=True)))


def compared(measured: Measured, truth: Measured) -> dict[str, Any]:
    """Deviations in %."""
    found: dict[str, float] = {}
    for name, one, other in (
        ("V", measured.roughness, truth.roughness),
        ("A", measured.area, truth.area),
    ):
        off = 100.0 * np.abs(one / other - 1.0)
        found |= {f"{name} median %": float(np.median(off)), f"{name} worst %": float(off.max())}
    return found


def stacked(reliefs: dict[str, Array]) -> Tensor:
    return torch.as_tensor(np.stack(list(reliefs.values())))


def resampled(heights: Tensor, samples: int) -> Tensor:
    """Cubic interpolation at the pixel centres of another grid."""
    grid = (samples, samples)
    return torch.nn.functional.interpolate(
        heights[:, None], grid, mode="bicubic", align_corners=False
    ).squeeze(1)
