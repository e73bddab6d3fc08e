"""Terraces: heights that are rounded to levels, wherever the rounding comes from.

Grey of 8 bits, grey that was stretched, normalised or bent by a gamma curve after rounding, and lengths rounded
to 0.01 mm have two things in common, in files of 8 bits, 16 bits and floating-point numbers alike: almost all
samples lie on levels with empty bins of the histogram between them, and gaps between levels change little from
one level to the next.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from relief.ground.arrays import Array

BINS = 65536
"""Bins of the histogram from the lowest to the highest value, as many as 16 bits have."""
NEAREST_BINS = 4
"""Bins on either side of a level that hold no other level; the 4096 levels of 12 bits are 16 bins apart."""
LEAST_SHARE = 0.7
"""Least share of samples on levels. Peaks of the histogram of a surface without levels have 0.1 to 0.4."""
SURE_COUNT = 16
"""Samples that make a level certain: between two such levels a third is empty by chance once in exp(16)."""
LEAST_REGULAR = 0.75
"""Least share of gaps of half to twice the local gap; of gaps between heights at random it is 0.55 to 0.6."""
FEWEST_LEVELS = 8
"""Levels below which a picture is a drawing, or a relief of plateaus that are meant."""
FEW_LEVELS, LEAST_BY_ONE = 32, 0.75
"""Below the first number of levels, least share of the changes between neighbours that are by one level.
Slopes rise level by level; in a mosaic of 8 levels at random 25 % of the changes are by one, of 31 levels 6 %."""
MOST_SAMPLES = 2**21
"""Samples that are looked at, in whole rows; more would take longer and find the same levels."""
LEAST_FLAT = 0.005
"""Least share of samples that are level with three neighbours. Quantised waves over all levels have 0.02. Samples
of a grating at 45 degrees lie on few heights as well, but are never level with their neighbours."""
LEAST_STEP_MM = 0.001
"""Least step of terraces that are reported, mm. People detect an edge of 0.85 µm on a smooth plate (Johansson and
LaMotte 1983), and 1 µm on a sample of 0.08 mm turns the surface by 0.7 degrees."""
LEAST_GENTLE, LEAST_EDGES, LEAST_LEVEL = 0.65, 0.05, 0.05
"""Least shares of neighbours that are at most one step apart and that are just one step apart, and least share of
samples level with three neighbours, in terraces that are reported. Rough textures in 8 bits have 0.03 to 0.6 of
the first, plateaus between steep flanks 0.02 of the second, ramps without terraces none of the third."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps of rounded heights.

    Attributes:
        middles: (n,) heights in the middle between neighbouring levels, ascending.
        gaps: (n,) gap between levels near each of these heights.
        count: Number of levels; 0 if unknown.
        flat: Share of samples that are level with three neighbours.
    """

    middles: Array
    gaps: Array
    count: int = 0
    flat: float = 0.0

    def near(self, values: ArrayLike) -> Array:
        """Gap between levels near each value, in the shape of ``values``."""
        return np.interp(values, self.middles, self.gaps)

    def changes(self, values: Array) -> Array:
        """Absolute differences of neighbours in a row, (rows, cols - 1), in gaps."""
        return np.abs(np.diff(values, axis=1)) / self.near(values[:, 1:])


def found_steps(values: ArrayLike, rounding: float | None = None) -> Steps | None:
    """The steps of rounded values; None if there are none, or if they are plateaus and stand for no slopes.

    Args:
        values: (rows, cols) values in any unit; NaN where nothing was measured.
        rounding: Step of the whole numbers in a file of at most 8 bits, where no other steps are found.
    """
    values = np.asarray(values)
    every = _stride(values)
    pairs = np.stack([values[:-1:every], values[1::every]]).astype(np.float64)
    finite = np.isfinite(pairs)
    low, high = np.min(pairs[finite], initial=np.inf), np.max(pairs[finite], initial=-np.inf)
    if not low < high:
        return None
    unit = (high - low) / (BINS - 1)
    bins = np.where(finite, np.rint((np.where(finite, pairs, low) - low) / unit), -1.0).astype(np.int32)
    # A height that a grating or enlarged pixels repeat in whole rows or columns is no level for that.
    upper, lower = bins[:, (bins[0] != bins[1]).any(axis=1)]
    new = np.append(True, (upper[:, 1:] != upper[:, :-1]).any(axis=0))
    upper, lower = upper[:, new], lower[:, new]
    right = upper[:, 1:]
    flat = (right == upper[:, :-1]) & (right == lower[:, 1:]) & (right == lower[:, :-1]) & (right >= 0)
    # The middle of a terrace keeps its level where a picture was resampled, which its edge does not.
    kept, steps = (_steps_of(held, low, unit) for held in (right[flat], upper[upper >= 0]))
    if kept is not None and (steps is None or np.median(kept.gaps / steps.near(kept.middles)) > 1.5):
        steps = kept
    if steps is None or np.mean(flat) < LEAST_FLAT:
        few = np.count_nonzero(np.bincount(bins[finite])) < FEWEST_LEVELS
        return None if few or rounding is None else Steps(np.array([low, high]), np.full(2, rounding))
    changes = steps.changes(pairs[0])
    by_one = np.count_nonzero((changes > 0.5) & (changes < 1.5)) / max(1, np.count_nonzero(changes > 0.5))
    if steps.count < FEW_LEVELS and by_one < LEAST_BY_ONE:
        return None
    return replace(steps, flat=float(np.mean(flat)))


def _stride(values: NDArray[np.generic]) -> int:
    """Rows from one of those that are looked at to the next."""
    return max(1, -(-values.size // MOST_SAMPLES))


def _steps_of(bins: NDArray[np.int32], low: float, unit: float) -> Steps | None:
    """The steps of samples.

    Args:
        bins: (n,) bins of the samples.
        low: Value in the middle of the first bin.
        unit: Width of a bin.
    """
    counts = np.bincount(bins, minlength=BINS)
    nearby = sliding_window_view(np.pad(counts, NEAREST_BINS), 2 * NEAREST_BINS + 1).max(axis=1)
    levels = np.flatnonzero((counts == nearby) & (counts > 0))
    sure = counts[levels] >= SURE_COUNT
    both = sure[1:] & sure[:-1]
    if np.count_nonzero(both) < FEWEST_LEVELS - 1:
        return None
    gaps, middles = np.diff(levels)[both], (0.5 * (levels[1:] + levels[:-1]))[both]
    # The middle three of five gaps: levels that were rounded again lie 4 and 5 apart, and one may be missing.
    local = np.sort(sliding_window_view(np.pad(gaps, 2, "reflect"), 5), axis=1)[:, 1:-1].mean(axis=1)
    # Plateaus that are meant would outweigh all samples that lie between levels.
    on = np.minimum(counts[levels], 4.0 * np.median(counts[levels])).sum()
    share = on / (on + len(bins) - counts[levels].sum())
    regular = np.mean((gaps <= 2.1 * local) & (local <= 2.1 * gaps))
    if share < LEAST_SHARE or regular < LEAST_REGULAR:
        return None
    return Steps(low + unit * middles, unit * local, len(levels))


def terraces(heights: Array) -> str | None:
    """What a person should know of terraces that a finger and light find in a height map, or None.

    Args:
        heights: (rows, cols) mm.
    """
    steps = found_steps(heights)
    if steps is None or steps.flat < LEAST_LEVEL:
        return None
    rows = heights[:: _stride(heights)]
    step, changes = float(np.median(steps.near(rows))), steps.changes(rows)
    gentle = changes < 1.5
    edges = gentle & (changes > 0.5)
    if step < LEAST_STEP_MM or np.mean(gentle) < LEAST_GENTLE or np.mean(edges) < LEAST_EDGES:
        return None
    return (
        f"{steps.count} levels, steps of {step:.2g} mm: terraces to finger and light; "
        "retouch prepare smooths them"
    )
