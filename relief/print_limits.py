"""Limits of a printer: the slopes and features that it prints, and the nearest relief within these limits."""

from functools import reduce
from math import atan, cos, hypot, inf, radians, tan

import numpy as np
import scipy
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.printers import STEEPEST_DEGREES, Printer

_QUARTER = ((0, 1), (1, 2), (1, 1), (2, 1))
MOVES = tuple(turned for dy, dx in _QUARTER for turned in ((dy, dx), (dx, -dy), (-dy, -dx), (-dx, dy)))
"""Steps (rows, cols) whose sums are all steps between pixels, as neighbouring directions span the grid."""
STRAIGHT = cos(0.5 * atan(0.5))
"""Least distance between two pixels in units of the shortest sum of such steps: 0.973."""
SAME = 1e-9
"""Share of a layer by which whole layers may be off by rounding."""
MOST_ACROSS = 255
"""Most pixels across the smallest feature: the time of the morphological opening grows with this number."""


class PrintLimits:
    """Largest slope and smallest feature of a printer, on pixels of a plate.

    A surface keeps the slope if its height differs between any two points by their distance times the tangent
    at most. Slopes of the computed surfaces are 97 to 100 % of the limit, by direction. A print has steps of
    its own, so it keeps the slope if such a surface lies within half a layer of each of its pixels.

    Args:
        printer: whose limits.
        pitch_mm: distance of neighbouring pixels.
        repeats: axes (rows, cols) along which the relief is periodic.

    Raises:
        InputError: the smallest feature is too many pixels wide.
    """

    def __init__(
        self, printer: Printer, pitch_mm: float, repeats: tuple[bool, bool] = (False, False)
    ) -> None:
        self._printer, self._repeats = printer, repeats
        self.any_slope = printer.max_slope_degrees >= STEEPEST_DEGREES
        """Whether the printer makes upright walls."""
        self._rise_mm = inf
        if not self.any_slope:
            self._rise_mm = STRAIGHT * pitch_mm * tan(radians(printer.max_slope_degrees))
        reach = printer.min_feature_um / 2000.0 / pitch_mm
        self._wide = 2 * int(reach) + 1
        """Pixels across a disc as wide as the smallest feature."""
        if self._wide > MOST_ACROSS:
            raise InputError(
                f"printer: min_feature_um: {printer.min_feature_um:g} um are {self._wide} pixels of "
                f"{1000.0 * pitch_mm:.4g} um; at most {MOST_ACROSS} can be computed"
            )
        self._rectangles = _rectangles(reach)

    def in_layers(self, heights: Array) -> Array:
        """The print of a design (rows, cols), mm: whole layers within the limits."""
        return self.nearest(self.gentle(heights))

    def nearest(self, heights: Array) -> Array:
        """Whole layers (rows, cols), mm, within the limits: the nearest layers wherever these are."""
        layer_mm = self._printer.layer_mm
        # A layer is solid from its middle on.
        layers = np.floor(heights / layer_mm + 0.5)
        if not self.any_slope:
            layers = np.floor(0.5 * sum(self.bounds(layers * layer_mm, layers * layer_mm)))
        if self._printer.keep_features:
            layers = self._without_fine(layers)
        return layers * layer_mm

    def bounds(self, greatest: Array, least: Array) -> tuple[Array, Array]:
        """The most and the fewest whole layers (rows, cols) of prints that keep the slope.

        A print that keeps it has at most the layers of the slope, rounded up, between any two pixels.

        Args:
            greatest: (rows, cols) mm, heights not to be exceeded; infinite where any is good.
            least: (rows, cols) mm, not to be undercut.
        """
        layer_mm = self._printer.layer_mm
        most = np.ceil(self.below(greatest) / layer_mm - SAME)
        return most, np.floor(self.above(least) / layer_mm + SAME)

    def eased(self, heights: Array) -> Array:
        """The nearest surface (rows, cols), mm, that keeps the slope but for steps of a layer."""
        if self.any_slope:
            return heights
        layer_mm = self._printer.layer_mm
        low = np.minimum(heights, self.below(heights) + layer_mm)
        return np.asarray(0.5 * (low + np.maximum(heights, self.above(heights) - layer_mm)))

    def gentle(self, heights: Array) -> Array:
        """The nearest surface (rows, cols), mm, that keeps the slope, by the largest difference."""
        if self.any_slope:
            return heights
        return np.asarray(0.5 * (self.below(heights) + self.above(heights)))

    def below(self, heights: Array) -> Array:
        """The highest surface that keeps the slope and is nowhere above heights (rows, cols), mm."""
        longest = max(heights.shape)
        spread = float(np.ptp(heights)) if np.isfinite(heights).all() else inf
        envelope = heights
        for move in MOVES if not self.any_slope else ():
            rise_mm, times = self._rise_mm * hypot(*move), 1
            # After steps of 1, 2, 4, ... all multiples are among the sums.
            while times * rise_mm < spread and times < 2 * longest:
                envelope = np.minimum(
                    envelope, self._moved(envelope, times * move[0], times * move[1]) + times * rise_mm
                )
                times *= 2
        return envelope

    def above(self, heights: Array) -> Array:
        """The lowest surface that keeps the slope and is nowhere below heights (rows, cols), mm."""
        return -self.below(-heights)

    def too_steep(self, heights: Array) -> NDArray[np.bool_]:
        """Pixels (rows, cols) of a print that no surface of a slope within the limit comes near."""
        least = (1.0 - SAME) * self._printer.layer_mm
        return (heights - self.below(heights) > least) | (self.above(heights) - heights > least)

    def too_fine(self, heights: Array) -> NDArray[np.bool_]:
        """Pixels (rows, cols) of a print where narrow ridges or grooves stand out by more than a layer."""
        layers = np.rint(heights / self._printer.layer_mm)
        return np.maximum(layers - self._opened(layers), self._closed(layers) - layers) > 1.0

    def _without_fine(self, layers: Array) -> Array:
        """Numbers of layers (rows, cols) whose ridges and grooves are as wide as the smallest feature.

        Those of a single layer may be narrower. Where all is ridges and grooves, grooves are filled.
        """
        opened = np.minimum(layers, self._opened(layers) + 1.0)
        return np.asarray(np.maximum(opened, self._closed(opened) - 1.0))

    def _moved(self, field: Array, down: int, right: int) -> Array:
        """The field moved over the plate; infinite where nothing comes in."""
        moved = np.roll(field, (down, right), axis=(0, 1))
        for by, repeats, along in ((down, self._repeats[0], moved), (right, self._repeats[1], moved.T)):
            if by and not repeats:
                along[slice(by) if by > 0 else slice(by, None)] = inf
        return moved

    def _closed(self, layers: Array) -> Array:
        """Numbers of layers (rows, cols) with grooves narrower than the disc filled."""
        return -self._opened(-layers)

    def _opened(self, layers: Array) -> Array:
        """Numbers of layers (rows, cols) without ridges narrower than the disc."""
        wide = self._wide
        for axis, repeats in enumerate(self._repeats):
            around = [(wide, wide) if axis == each else (0, 0) for each in (0, 1)]
            layers = np.pad(layers, around, mode="wrap" if repeats else "symmetric")
        # The least under a disc is the least under the rectangles that make it up, which take far less time.
        low = reduce(np.minimum, (scipy.ndimage.minimum_filter(layers, each) for each in self._rectangles))
        high = reduce(np.maximum, (scipy.ndimage.maximum_filter(low, each) for each in self._rectangles))
        return np.asarray(high[wide:-wide, wide:-wide])


def _rectangles(reach: float) -> list[tuple[int, int]]:
    """Sides (rows, cols) of rectangles about one pixel that make up a disc of this radius, in pixels."""
    away = np.arange(int(reach) + 1)
    inside = np.hypot(away[:, None], away) <= reach
    widths = inside.sum(axis=1)
    # Of rows of the same width, the farthest from the middle; nearer ones lie within its rectangle.
    last = np.flatnonzero(np.diff(widths, append=0))
    return [(2 * int(row) + 1, 2 * int(widths[row]) - 1) for row in last]
