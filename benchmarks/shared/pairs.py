"""Two ways to do the same, timed in pairs in the order ABBA, and the interval of their ratio."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

RESAMPLES = 2000
"""Number of bootstrap resamples of the pairs."""


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
