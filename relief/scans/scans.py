"""A scan: measured heights of a print on a grid, with holes where nothing was measured."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve
from scipy.spatial import ConvexHull, QhullError

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.limits import LARGEST_SIDE, SMALLEST_SIDE

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution in units of its median absolute deviation."""
LEAST_MEASURED = 0.5
"""Least measured share of the area of a scan."""
LARGEST_MM = 1e6
"""Largest height, mm, of any scan; beyond a kilometre, a number stands for no measurement."""
MIXED_DIFFERENCE = np.outer((1.0, -2.0, 1.0), (1.0, -2.0, 1.0)) / 6.0
"""Second difference along both axes, scaled to keep the variance of white noise (J. Immerkaer, Computer
Vision and Image Understanding 64, 1996): planes and most of a surface that is finely sampled drop out."""


@dataclass(frozen=True, eq=False)
class Scan:
    """Measured heights of a print.

    Attributes:
        heights: (rows, cols) mm, row 0 at +y, column 0 at -x; NaN in holes. Level and slope mean nothing.
        pitch_mm: distance of neighbouring samples.
        name: file of the scan, for messages.
        middle_mm: x and y of the middle of these heights, mm from the middle of the file's, y upward.
        variance_mm2: variance of the blur by interpolation between samples of the file.
    """

    heights: Array
    pitch_mm: float
    name: str = "scan"
    middle_mm: tuple[float, float] = (0.0, 0.0)
    variance_mm2: float = 0.0

    @property
    def measured(self) -> NDArray[np.bool_]:
        """Samples (rows, cols) that hold a height."""
        return np.isfinite(self.heights)

    @property
    def size_mm(self) -> tuple[float, float]:
        """Extents along y and x, mm."""
        rows, cols = self.heights.shape
        return rows * self.pitch_mm, cols * self.pitch_mm

    @property
    def noise_mm(self) -> float:
        """Standard deviation, mm, of the noise that differs from sample to sample.

        A scanner that smooths has less of such noise, and a resolution coarser than its samples.
        """
        with np.errstate(invalid="ignore"):
            mixed = convolve(self.heights, MIXED_DIFFERENCE, mode="nearest")
        mixed = mixed[np.isfinite(mixed)]
        return float(MAD_TO_SIGMA * np.median(np.abs(mixed))) if mixed.size else 0.0

    @property
    def hole_share(self) -> float:
        """Share of the convex hull of the measured samples that holds no height."""
        rows, cols = np.nonzero(self.measured)
        # The ends of each row span the hull of all.
        ends = np.flatnonzero(
            np.diff(rows, prepend=-1) | np.diff(rows, append=rows[-1] + 1 if rows.size else 0)
        )
        corners = np.column_stack([rows[ends], cols[ends]])
        around = np.concatenate([corners + move for move in ((0, 0), (0, 1), (1, 0), (1, 1))])
        return max(0.0, 1.0 - rows.size / float(ConvexHull(around).volume))

    def axes_mm(self) -> tuple[Array, Array]:
        """Places of columns along x and of rows along y, mm from the middle of the file, y upward."""
        x, y = axes_mm(self.heights.shape, self.pitch_mm)
        return x + self.middle_mm[0], y + self.middle_mm[1]

    def places(self, x: Array, y: Array) -> Array:
        """(2, ...) rows and columns at points, mm from the middle of the file, y upward."""
        rows, cols = self.heights.shape
        down, along = (y - self.middle_mm[1]) / self.pitch_mm, (x - self.middle_mm[0]) / self.pitch_mm
        return np.stack([0.5 * (rows - 1) - down, along + 0.5 * (cols - 1)])

    def flipped(self) -> Self:
        """The scan as a mirror shows it, left and right exchanged."""
        x, y = self.middle_mm
        return replace(self, heights=self.heights[:, ::-1], middle_mm=(-x, y))

    def averaged(self, times: int) -> Self:
        """The scan on blocks of `times` samples a side; a block is measured if half of its samples are."""
        if times == 1:
            return self
        around = [(0, -side % times) for side in self.heights.shape]
        padded = self.cut(np.pad(self.heights, around, constant_values=np.nan), 0, 0)
        means = block_means(padded.heights, times, times)
        return replace(padded, heights=means, pitch_mm=self.pitch_mm * times)

    def cropped(self) -> Self:
        """The scan without rows and columns at its ends in which nothing is measured."""
        rows, cols = (np.flatnonzero(self.measured.any(axis=axis)) for axis in (1, 0))
        top, left = int(rows[0]), int(cols[0])
        return self.cut(self.heights[top : rows[-1] + 1, left : cols[-1] + 1], top, left)

    def cut(self, heights: Array, top: int, left: int) -> Self:
        """The scan with other heights, whose first sample lies at this row and column of the old ones."""
        (rows, cols), (down, across) = self.heights.shape, heights.shape
        x = self.middle_mm[0] + (left + 0.5 * (across - cols)) * self.pitch_mm
        y = self.middle_mm[1] - (top + 0.5 * (down - rows)) * self.pitch_mm
        return replace(self, heights=heights, middle_mm=(x, y))


def axes_mm(shape: tuple[int, ...], pitch_mm: float) -> tuple[Array, Array]:
    """Places of columns along x and of rows along y of a grid, mm from its middle, y upward."""
    rows, cols = shape
    x = (np.arange(cols) - 0.5 * (cols - 1)) * pitch_mm
    y = (0.5 * (rows - 1) - np.arange(rows)) * pitch_mm
    return np.asarray(x), np.asarray(y)


def block_means(heights: Array, down: int, across: int) -> Array:
    """Means of whole blocks of `down` x `across` samples; NaN where more than half of a block is."""
    rows, cols = heights.shape[0] // down, heights.shape[1] // across
    blocks = heights[: rows * down, : cols * across].reshape(rows, down, cols, across)
    there = np.isfinite(blocks)
    count = there.sum(axis=(1, 3))
    means = np.where(there, blocks, 0.0).sum(axis=(1, 3)) / np.maximum(count, 1)
    means[2 * count < down * across] = np.nan
    return np.asarray(means)


def check_scan(scan: Scan) -> Scan:
    """The scan, cropped to its measured samples.

    Raises:
        InputError: nothing or too little is measured, or there are too many samples or impossible heights.
    """
    measured = scan.measured
    if not measured.any():
        raise InputError(f"{scan.name}: holds no height at all")
    farthest = scan.heights[measured][np.argmax(np.abs(scan.heights[measured]))]
    if abs(farthest) > LARGEST_MM:
        unmeasured = "is it in another unit, or does the number stand for no measurement?"
        raise InputError(f"{scan.name}: holds a height of {farthest:g} mm; {unmeasured}")
    cut = scan.cropped()
    down, across = cut.heights.shape
    if min(down, across) < SMALLEST_SIDE:
        measured_side = f"{across} x {down} samples are measured"
        raise InputError(f"{scan.name}: {measured_side}; at least {SMALLEST_SIDE} a side are needed")
    if max(down, across) > LARGEST_SIDE:
        raise InputError(f"{scan.name}: {across} x {down} samples; at most {LARGEST_SIDE} a side are read")
    try:
        holes = cut.hole_share
    except QhullError as error:
        raise InputError(f"{scan.name}: what is measured lies on a line") from error
    if holes > 1.0 - LEAST_MEASURED:
        share = f"{100.0 * holes:.0f} % of it holds no height"
        raise InputError(f"{scan.name}: has more holes than surface: {share}")
    return cut
