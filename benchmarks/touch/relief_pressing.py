"""Pressing sets of reliefs by any model of touch: V, A and seconds, and how far they are from a truth."""

from __future__ import annotations

import time
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
REPEATS = 3


class Measured(NamedTuple):
    """V, A (mm²), share in contact, and seconds for each relief of a set, alone and in a batch."""

    roughness: Array
    area: Array
    fraction: Array
    alone_s: float
    batch_s: float


def measure(operator: SkinOperator, reliefs: Tensor, repeats: int = REPEATS) -> Measured:
    """Press on reliefs (count, n, n), in batches, and on the first few one by one."""
    flat = smallest_eigenvalue(
        operator.strain(solve_contact(operator, torch.zeros_like(reliefs[0]), MEAN).pressure)
    )

    def touched(heights: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        state = solve_contact(operator, heights, MEAN)
        strain = smallest_eigenvalue(operator.strain(state.pressure)) - flat
        return strain, state.gap, (state.pressure > 0.0).double().mean((-2, -1))

    alone = []
    for heights in reliefs[:repeats]:
        began = time.perf_counter()
        touched(heights)
        alone.append(time.perf_counter() - began)
    roughness, area, fraction, spent = [], [], [], 0.0
    for batch in reliefs.split(BATCH):
        began = time.perf_counter()
        strain, gap, share = touched(batch)
        spent += time.perf_counter() - began
        roughness.append(tactile.roughness(strain, SIZE_MM))
        area.append(tactile.contact_area(gap, SIZE_MM))
        fraction.append(share)
    return Measured(
        torch.cat(roughness).numpy(),
        torch.cat(area).numpy(),
        torch.cat(fraction).numpy(),
        float(np.median(alone)),
        spent / len(reliefs),
    )


def compared(measured: Measured, truth: Measured) -> dict[str, Any]:
    """Deviations in %, and seconds."""
    v, a = (
        100.0 * np.abs(one / other - 1.0)
        for one, other in ((measured.roughness, truth.roughness), (measured.area, truth.area))
    )
    return {
        "V median %": float(np.median(v)),
        "V worst %": float(v.max()),
        "A median %": float(np.median(a)),
        "A worst %": float(a.max()),
        "s alone": measured.alone_s,
        "s in a batch": measured.batch_s,
    }


def stacked(reliefs: dict[str, Array]) -> Tensor:
    return torch.as_tensor(np.stack(list(reliefs.values())))


def resampled(heights: Tensor, samples: int) -> Tensor:
    """Cubic interpolation at the pixel centres of another grid."""
    grid = (samples, samples)
    return torch.nn.functional.interpolate(
        heights[:, None], grid, mode="bicubic", align_corners=False
    ).squeeze(1)
