"""Contact solver of Retouch beside Tamaas, on a body that both have: a periodic half-space.

python -m benchmarks.touch.half_space [NAME ...] [--again]    # about five minutes on one core

Tamaas, which nothing depends on, has to be importable: `pip install --no-deps --target FOLDER tamaas`, then
with FOLDER on PYTHONPATH. Writes results/half_space.json and a place of docs/evidence/touch.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import scipy.sparse as sp
import torch
from scipy.ndimage import zoom

from benchmarks.shared.common import publish, rows_of, table_of
from benchmarks.touch.pressed_reliefs import SIDE, SIZE_MM
from benchmarks.touch.relief_pressing import MEAN, SKIN
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from tactile import sparse
from tactile.contact import SingleFirst, Stop
from tests.physics.half_space import PeriodicHalfSpace

TOLERANCE = 1e-8
"""Residual of contact over the mean displacement, by one measure for both solvers."""
FACTOR = 10.0**0.25
"""Step of Tamaas's own tolerance, on the search of the largest one that meets `TOLERANCE`."""
PAIRS = {128: 15, 512: 7, 1024: 5}
"""Pairs of runs by the samples along a side."""
RESAMPLES = 2000
"""Number of bootstrap resamples of the pairs."""


COLUMNS = {
    "Retouch, CPU s": "{over_cpu_s:.3g}",
    "Tamaas, CPU s": "{cpu_s:.3g}",
    "ratio (95 %)": "{ratio:.2f} ({low:.2f} to {high:.2f})",
    "pressures apart, of their peak": "{pressures_off:.0e}",
}


def main() -> None:
    measures = {f"{side} x {side}": partial(beside_tamaas, side, pairs) for side, pairs in PAIRS.items()}
    rows = rows_of(__doc__, "half_space", "rows", measures)
    publish("touch", "Tamaas", table_of("samples", rows, COLUMNS))


def beside_tamaas(samples: int, pairs: int) -> dict[str, Any]:
    """CPU seconds of both to one residual, with so many samples along a side."""
    # Once Pardiso has run, Tamaas takes the Fourier transforms of its library, MKL, and a third of the time.
    sparse.factorised(sp.identity(2, format="csr"))
    tile = np.asarray(load_heights(find_texture("gravel-tile")), dtype=np.float64)
    scale = samples / SIDE
    heights = tile if scale == 1.0 else zoom(tile, scale, order=3, mode="grid-wrap", grid_mode=True)
    heights = np.ascontiguousarray(heights)
    body = PeriodicHalfSpace(samples, SIZE_MM, SKIN.poisson_ratio)
    theirs = tamaas_pressure(heights)
    tolerance = TOLERANCE * FACTOR**8
    while measured(body, heights, theirs(tolerance))["residual"] > TOLERANCE:
        tolerance /= FACTOR
    ours = partial(SingleFirst(body, Stop(residual=TOLERANCE)), body, torch.as_tensor(heights), MEAN, None)
    pressures = ours().pressure.numpy(), theirs(tolerance)
    seconds = in_pairs(cpu_of(ours), cpu_of(partial(theirs, tolerance)), pairs)
    return {
        **ratio(seconds[1], seconds[0]),
        "ours": measured(body, heights, pressures[0]),
        "tamaas": measured(body, heights, pressures[1]),
        "pressures_off": float(np.abs(pressures[0] - pressures[1]).max() / pressures[1].max()),
    }


def in_pairs(
    one: Callable[[], float], other: Callable[[], float], pairs: int
) -> tuple[list[float], list[float]]:
    """CPU seconds that both calls return, pair by pair; the order changes from pair to pair."""
    seconds: tuple[list[float], list[float]] = ([], [])
    for number in range(pairs):
        for which in (0, 1) if number % 2 == 0 else (1, 0):
            seconds[which].append((one, other)[which]())
    return seconds


def ratio(seconds: Sequence[float], over: Sequence[float]) -> dict[str, Any]:
    """Median of the ratios of pairs, with its 95 % bootstrap interval, and both medians."""
    logs = np.log(np.asarray(seconds) / np.asarray(over))
    draws = np.random.default_rng(0).integers(0, len(logs), (RESAMPLES, len(logs)))
    low, high = np.quantile(np.median(logs[draws], axis=1), (0.025, 0.975))
    return {
        "cpu_s": float(np.median(seconds)),
        "over_cpu_s": float(np.median(over)),
        "ratio": float(np.exp(np.median(logs))),
        "low": float(np.exp(low)),
        "high": float(np.exp(high)),
        "pairs": len(logs),
    }


def cpu_of(work: Callable[[], object]) -> Callable[[], float]:
    """A call that returns the CPU seconds of another."""

    def timed() -> float:
        began = time.process_time()
        work()
        return time.process_time() - began

    return timed


def measured(body: PeriodicHalfSpace, heights: Array, pressure: Array) -> dict[str, float]:
    """Residual over the mean displacement and bound of the energy's error, as in `tactile.contact`."""
    p = torch.as_tensor(pressure)
    displacement, contact = body.displacement(p), p > 0.0
    gap = displacement - torch.as_tensor(heights)
    gap -= gap[contact].mean()
    inside = ((gap.square() * p).sum() / p.sum()).sqrt()
    outside = -gap[~contact].min()
    released = (p * gap).sum() - p.sum() * gap.min()
    return {
        "residual": float(torch.maximum(inside, outside) / displacement.mean()),
        "bound": float(released / (0.5 * (p * displacement).sum())),
    }


def tamaas_pressure(heights: Array) -> Callable[[float], Array]:
    """Pressures (units of E) by Tamaas's Polonsky-Keer to a tolerance of its own."""
    import tamaas

    tamaas.set_log_level(tamaas.LogLevel.warning)
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [SIZE_MM] * 2, list(heights.shape))
    model.E, model.nu = 1.0, SKIN.poisson_ratio

    def solve(tolerance: float) -> Array:
        model.traction[...] = 0.0
        tamaas.PolonskyKeerRey(model, heights, tolerance).solve(MEAN)
        return np.array(model.traction)

    return solve


if __name__ == "__main__":
    main()
