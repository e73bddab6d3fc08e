"""Terraces: heights that are rounded to levels, wherever the rounding comes from.

Grey of 8 bits, grey that was stretched, normalised or bent by a gamma curve after rounding, and lengths
rounded to 0.01 mm have two things in common, in files of 8 bits, 16 bits and floating-point numbers alike.
Almost all samples are on levels with empty bins of the histogram between them, and the gaps between levels
change little from one level to the next.
"""

from dataclasses import dataclass

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
"""Number of levels, and least share of the changes between neighbours that are by one level where levels are
fewer. Slopes rise level by level; in a mosaic of 8 levels at random 25 % of the changes are by one level."""
MOST_SAMPLES = 2**21
"""Samples that are looked at, in whole rows; more would take longer and find the same levels."""
LEAST_STEP_MM = 0.001
"""Least step of terraces that are reported, mm. People detect an edge of 0.85 µm on a smooth plate (Johansson
and LaMotte 1983), and 1 µm from one sample to the next, 0.08 mm apart, is a slope of 0.7 degrees."""
LEAST_GENTLE, LEAST_EDGES = 0.65, 0.05
"""Least shares in terraces that are reported: of neighbours less than 1.5 steps apart, and of neighbours 0.1
to 1.5 steps apart. Rough textures in 8 bits have 0.03 to 0.6 of the first, and plateaus between steep flanks
0.02 of the second."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Steps of rounded heights.

    Attributes:
        middles: (n,) heights in the middle between neighbouring levels, ascending.
        gaps: (n,) gap between levels near each of these heights.
        count: Number of levels.
    """

    middles: Array
    gaps: Array
    count: int

    def near(self, values: ArrayLike) -> Array:
        """Gap between levels near each value, in the shape of ``values``."""
        return np.interp(np.asarray(values, dtype=np.float64), self.middles, self.gaps)

    def changes(self, values: Array) -> Array:
        """Absolute differences of neighbours in a row, (rows, cols - 1), in gaps."""
        return np.abs(np.diff(values, axis=1)) / self.near(values[:, 1:])


def found_steps(values: ArrayLike, rounding: float | None = None) -> Steps | None:
    """The steps of rounded values; None if there are none, or if they are plateaus and stand for no slopes.

    Args:
        values: (rows, cols) values in any unit; NaN where nothing was measured.
        rounding: Step of the whole numbers in a file of at most 8 bits, where no larger steps are found.
    """
    values = np.asarray(values)
    every = _stride(values)
    pairs = np.stack([values[:-1:every], values[1::every]]).astype(np.float64)
    finite = np.isfinite(pairs)
    low = float(np.min(pairs[finite], initial=np.inf))
    unit = (float(np.max(pairs[finite], initial=-np.inf)) - low) / (BINS - 1)
    if not unit > 0.0:
        return None
    bins = np.where(finite, np.rint((np.where(finite, pairs, low) - low) / unit), -1.0).astype(np.int32)
    steps = _by_histogram(bins, low, unit)
    if rounding is not None and (steps is None or np.median(steps.gaps) < 1.5 * rounding):
        distinct = np.count_nonzero(np.bincount(bins[finite]))
        steps = Steps(np.array([low, low + 1.0]), np.full(2, rounding), int(distinct))
    if steps is None or steps.count < FEWEST_LEVELS:
        return None
    changes = steps.changes(pairs[0])
    # An edge of a picture that was enlarged rises by less than a step from sample to sample.
    gentle, edges = np.count_nonzero((changes > 0.1) & (changes < 1.5)), np.count_nonzero(changes > 0.1)
    if steps.count < FEW_LEVELS and gentle < LEAST_BY_ONE * edges:
        return None
    return steps


def _stride(values: NDArray[np.generic]) -> int:
    """Rows from one of those that are looked at to the next."""
    return max(1, -(-values.size // MOST_SAMPLES))


def _by_histogram(bins: NDArray[np.int32], low: float, unit: float) -> Steps | None:
    """The steps of pairs of rows.

    Args:
        bins: (2, rows, cols) bins of the samples in the upper and the lower row of each pair; -1: none.
        low: Value in the middle of the first bin.
        unit: Width of a bin.
    """
    # A height that a grating or enlarged pixels repeat in whole rows or columns is no level for that.
    upper, lower = bins[:, (bins[0] != bins[1]).any(axis=1)]
    new = np.append(True, (upper[:, 1:] != upper[:, :-1]).any(axis=0))
    upper, lower = upper[:, new], lower[:, new]
    right = upper[:, 1:]
    level = (right == upper[:, :-1]) & (right == lower[:, 1:]) & (right == lower[:, :-1]) & (right >= 0)
    # The middle of a terrace keeps its level where a picture was resampled, which its edge does not.
    kept, steps = (_steps_of(held, low, unit) for held in (right[level], upper[upper >= 0]))
    if kept is not None and (steps is None or np.median(kept.gaps / steps.near(kept.middles)) > 1.5):
        steps = kept
    # Samples of cones and slanted gratings share heights as well, but few of these make a level place.
    return steps if np.count_nonzero(np.bincount(right[level])) >= FEWEST_LEVELS else None


def _steps_of(bins: NDArray[np.int32], low: float, unit: float) -> Steps | None:
    """The steps of samples, (n,) bins, with the value of the first bin and the width of a bin."""
    counts = np.bincount(bins, minlength=BINS)
    nearby = sliding_window_view(np.pad(counts, NEAREST_BINS), 2 * NEAREST_BINS + 1).max(axis=1)
    levels = np.flatnonzero((counts == nearby) & (counts > 0))
    sure = counts[levels] >= SURE_COUNT
    both = sure[1:] & sure[:-1]
    if np.count_nonzero(both) < FEWEST_LEVELS - 1:
        return None
    gaps, middles = np.diff(levels)[both], 0.5 * (levels[1:] + levels[:-1])[both].astype(np.float64)
    # The middle three of five gaps: levels that were rounded again are 4 and 5 apart, and one may be missing.
    fives = sliding_window_view(np.pad(gaps, 2, "reflect"), 5)
    local = np.asarray(np.sort(fives, axis=1)[:, 1:-1].mean(axis=1), dtype=np.float64)
    regular = np.mean((gaps <= 2.1 * local) & (local <= 2.1 * gaps))
    if counts[levels].sum() < LEAST_SHARE * len(bins) or regular < LEAST_REGULAR:
        return None
    return Steps(low + unit * middles, unit * local, len(levels))


def terraces(heights: Array) -> str | None:
    """What a person should know of terraces that a finger and light find in a height map, or None.

    Args:
        heights: (rows, cols) mm.
    """
    steps = found_steps(heights)
    if steps is None:
        return None
    rows = heights[:: _stride(heights)]
    step, changes = float(np.median(steps.near(rows))), steps.changes(rows)
    gentle = changes < 1.5
    edges = gentle & (changes > 0.1)
    if step < LEAST_STEP_MM or np.mean(gentle) < LEAST_GENTLE or np.mean(edges) < LEAST_EDGES:
        return None
    found = f"{steps.count} levels, steps of {step:.2g} mm"
    return f"{found}: terraces to finger and light; retouch prepare smooths them"
