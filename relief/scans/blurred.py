"""A design as a blurring printer makes it: exact Gaussian blur, with its derivatives, at any point.

A cosine transform on the grid of the design holds the relief, with mirror images beyond its rim. Blur of
variance q multiplies the coefficient of wave number k by exp(-q k²/2), on any grid.
"""

from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dctn, idctn
from scipy.ndimage import map_coordinates

from relief.ground.arrays import Array
from relief.relief import Relief
from relief.scans.scans import axes_mm

CUBIC, LINEAR = 3, 1
"""Orders of the splines of heights, and of derivatives, whose accuracy affects the number of steps alone."""


@dataclass(frozen=True, eq=False)
class Derivatives:
    """A blurred design at points, (n,) each.

    Attributes:
        heights: mm.
        along_x, along_y: slopes, no unit.
        by_variance: derivative by the variance of the blur, mm per mm².
        seen: mm, heights without waves that a scan does not show.
    """

    heights: Array
    along_x: Array
    along_y: Array
    by_variance: Array
    seen: Array


FINER = 8
"""Most samples along a side for one sample of a relief."""


def surface_of(relief: Relief, most: int) -> Array:
    """The surface of a relief as a plate has it, on finer samples: linear between samples, or flat pixels.

    Args:
        relief: the print of a printer has a flat pixel for each sample (`relief.solids.export.plate_export`).
        most: samples a side, unless the relief has more.

    Returns:
        (rows * n, cols * n) mm.
    """
    times = max(1, min(FINER, most // max(relief.heights.shape)))
    if relief.printer is not None:
        return np.asarray(relief.heights.repeat(times, axis=0).repeat(times, axis=1))
    along = [(np.arange(side * times) + 0.5) / times - 0.5 for side in relief.heights.shape]
    places = np.meshgrid(*along, indexing="ij")
    return np.asarray(map_coordinates(relief.heights, places, order=LINEAR, mode="nearest"))


class DesignSpectrum:
    """A design that can be blurred.

    Args:
        heights: (rows, cols) mm, row 0 at +y.
        width_mm: extent along x.
        most: samples a side; more are brought down to so many, without aliasing.

    Attributes:
        size_mm: extents along y and x.
        pitch_mm: of the grid on which it is held.
        shape: of that grid.
    """

    def __init__(self, heights: Array, width_mm: float, most: int) -> None:
        rows, cols = heights.shape
        self.size_mm = width_mm * rows / cols, width_mm
        self.level_mm = float(heights.mean())
        self._hold(dctn(heights - self.level_mm, norm="ortho"), most)

    def coarser(self, most: int) -> "DesignSpectrum":
        """The same design on at most so many samples a side, without aliasing."""
        if max(self.shape) <= most:
            return self
        other = copy(self)
        other._hold(self._coefficients, most)
        return other

    def _hold(self, coefficients: Array, most: int) -> None:
        """Keep as many coefficients as there are samples."""
        rows, cols = coefficients.shape
        held = min(1.0, most / max(rows, cols))
        down, across = round(rows * held), round(cols * held)
        self._coefficients = coefficients[:down, :across] * np.sqrt(down * across / (rows * cols))
        self.shape = down, across
        self._steps = self.size_mm[0] / down, self.size_mm[1] / across
        self.pitch_mm = self._steps[1]
        # Wave numbers, rad/mm.
        down_k, across_k = (
            np.pi * np.arange(n) / size for n, size in zip(self.shape, self.size_mm, strict=True)
        )
        self._squares = down_k[:, None] ** 2 + across_k**2

    def variance_kept(self, variance_mm2: float) -> float:
        """Share of the variance of the heights that is left after a blur."""
        squares = np.square(self._coefficients)
        squares[0, 0] = 0.0
        whole = max(float(squares.sum()), np.finfo(float).tiny)
        return float((squares * np.exp(-variance_mm2 * self._squares)).sum()) / whole

    def blurred(self, variance_mm2: float) -> Array:
        """Heights on the grid about their mean, after a blur of this variance, 0 or more."""
        return np.asarray(
            idctn(self._coefficients * np.exp(-0.5 * variance_mm2 * self._squares), norm="ortho")
        )

    def inside(self, x: Array, y: Array, margin_mm: float = 0.0) -> NDArray[np.bool_]:
        """Whether points, mm from the middle, y upward, lie on the plate, off its rim by a margin."""
        high, wide = self.size_mm
        return np.asarray((np.abs(x) <= 0.5 * wide - margin_mm) & (np.abs(y) <= 0.5 * high - margin_mm))

    def at(self, x: Array, y: Array, variance_mm2: float, pitch_mm: float = 0.0) -> Derivatives:
        """The blurred design and its derivatives at points, mm from the middle, y upward.

        Waves shorter than two samples of a pitch are in `heights` alone: a scan does not tell where they lie,
        how high they are or how blurred. Negative variances, which noise can cause, are extrapolated linearly
        from 0 without them, as they would make spikes of the edges of a surface linear between samples.
        """
        positive, negative = max(variance_mm2, 0.0), min(variance_mm2, 0.0)
        spectrum = self._coefficients * np.exp(-0.5 * positive * self._squares)
        shown = spectrum
        if pitch_mm > 0.0:
            shown = np.where(self._squares < (np.pi / pitch_mm) ** 2, spectrum, 0.0)
        by_variance = idctn(-0.5 * self._squares * shown, norm="ortho")
        heights, seen = (idctn(each, norm="ortho") + negative * by_variance for each in (spectrum, shown))
        down, along = np.gradient(seen, *self._steps)
        places = self.places(x, y)
        return Derivatives(
            _read(heights, places, CUBIC),
            _read(along, places, LINEAR),
            -_read(down, places, LINEAR),
            _read(by_variance, places, LINEAR),
            _read(seen, places, LINEAR),
        )

    def places(self, x: Array, y: Array) -> Array:
        """(2, n) rows and columns of the grid at points, mm from the middle, y upward."""
        down, along = self._steps
        return np.stack([0.5 * (self.shape[0] - 1) - y / down, x / along + 0.5 * (self.shape[1] - 1)])


def _read(values: Array, places: Array, order: int) -> Array:
    return np.asarray(map_coordinates(values, places, order=order, mode="reflect"))


def samples_mm(relief: Relief) -> tuple[Array, Array]:
    """Places x and y (rows, cols) of the samples of a relief, mm from its middle, y upward."""
    x, y = np.meshgrid(*axes_mm(relief.heights.shape, relief.pitch_mm))
    return x, y
