"""Contact solver of Retouch beside others, on a body that all of them have: a periodic half-space."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import torch
from torch import Tensor

from benchmarks.shared.common import median_seconds
from benchmarks.touch.pressed_reliefs import SIDE, SIZE_MM, twelve
from benchmarks.touch.relief_pressing import MEAN, REPEATS, SKIN, Array
from tactile.contact import solve_contact
from tests.physics.half_space import PeriodicHalfSpace

TOLERANCE = 1e-8
"""Residual of contact over the mean displacement, the same for every solver."""


def half_space() -> list[dict[str, Any]]:
    """Seconds on a periodic half-space beside Tamaas and ContactMechanics, where installed."""
    body = PeriodicHalfSpace(SIDE, SIZE_MM, SKIN.poisson_ratio)
    rivals = {"Tamaas": tamaas_pressure, "ContactMechanics": contact_mechanics_pressure}
    rows = []
    for name, relief in list(twelve().items())[::3]:
        heights = torch.as_tensor(relief)

        def ours(heights: Tensor = heights) -> Array:
            return solve_contact(body, heights, MEAN, tolerance=TOLERANCE).pressure.numpy()

        row: dict[str, Any] = {"relief": name, "ours s": median_seconds(ours, REPEATS)}
        for rival, solver in rivals.items():
            solve = solver(np.ascontiguousarray(relief))
            if solve is not None:
                seconds, pressure = median_seconds(solve, REPEATS), solve()
                off = np.abs(ours() - pressure).max() / pressure.max()
                row |= {
                    f"{rival} s": seconds,
                    f"{rival} / ours": seconds / row["ours s"],
                    f"pressures off {rival}": float(off),
                }
        rows.append(row)
    return rows


def tamaas_pressure(heights: Array) -> Callable[[], Array] | None:
    """Polonsky-Keer by Tamaas; None if not installed."""
    try:
        import tamaas
    except ImportError:
        return None
    tamaas.set_log_level(tamaas.LogLevel.warning)
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [SIZE_MM] * 2, [SIDE] * 2)
    model.E, model.nu = 1.0, SKIN.poisson_ratio

    def solve() -> Array:
        model.traction[...] = 0.0
        tamaas.PolonskyKeerRey(model, heights, TOLERANCE).solve(MEAN)
        return np.array(model.traction)

    return solve


def contact_mechanics_pressure(heights: Array) -> Callable[[], Array] | None:
    """Constrained conjugate gradient of ContactMechanics; None if not installed."""
    try:
        from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
        from SurfaceTopography import Topography
    except ImportError:
        return None
    modulus = 1.0 / (1.0 - SKIN.poisson_ratio**2)
    half = PeriodicFFTElasticHalfSpace((SIDE, SIDE), modulus, (SIZE_MM, SIZE_MM))
    system = make_system(substrate=half, surface=Topography(heights, (SIZE_MM, SIZE_MM), periodic=True))

    def solve() -> Array:
        result = system.minimize_proxy(external_force=MEAN * SIZE_MM**2, pentol=TOLERANCE)
        return np.abs(np.asarray(result.jac)) * (SIDE / SIZE_MM) ** 2

    return solve
