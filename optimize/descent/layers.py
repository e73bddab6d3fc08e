"""Whole layers: reliefs that a printer makes exactly.

The original is as printed, and a change by whole layers keeps all its steps where they are. A descent rounds
the relief that counts to whole layers (`optimize.descent.gauss_newton.terms.LayerTerm`).
"""

import numpy as np

from relief.depth import out_of_reach
from relief.ground.arrays import Array
from relief.ground.limits import HEIGHT_LIMIT_MM
from relief.print_limits import PrintLimits
from relief.printers import Printer
from relief.surface import Surface


class Layers:
    """Whole layers of a printer, counted from height 0, with its largest slope and greatest relief.

    Args:
        original: (rows, cols) mm, a print.
        printer: that makes it.
        surface: size of the plate, and the axes on which it repeats.
    """

    def __init__(self, original: Array, printer: Printer, surface: Surface) -> None:
        self._original, self._layer_mm = original, printer.layer_mm
        self._limits = PrintLimits(printer, surface.pitch_mm, surface.repeats)
        self._relief_mm = printer.top_mm(printer.max_relief_mm)
        self._floor, self._top = 0.0, printer.top_mm(HEIGHT_LIMIT_MM)
        self._deep = original.max() > HEIGHT_LIMIT_MM
        if self._deep:
            # Only the uppermost 3 mm change (`relief.depth`).
            self._floor, self._top = float(original.max()) - self._top, float(original.max())
        self._frozen = out_of_reach(original)
        # Frozen samples bound all samples that keep the printer's slope to them.
        self._least: Array | float = -np.inf
        self._greatest: Array | float = np.inf
        if self._frozen is not None and not self._limits.any_slope:
            ends = (np.where(self._frozen, original, sign * np.inf) for sign in (1.0, -1.0))
            most, fewest = self._limits.bounds(*ends)
            self._greatest, self._least = most * self._layer_mm, fewest * self._layer_mm

    def rounded(self, heights: Array) -> Array:
        """The nearest heights of whole layers within the printer's limits, (rows, cols) mm."""
        layers = np.clip(self._limits.nearest(heights), self._least, self._greatest)
        return self._kept(np.clip(layers, self._floor, self._top))

    def to_nearest(self, heights: Array) -> Array:
        """(samples,) mm from each height to the nearest layer."""
        return np.asarray((self.rounded(heights) - heights).ravel())

    def placed(self, heights: Array) -> Array:
        """Heights moved by whole layers, to the original's mean and into the limits; what is left is cut.

        Heights keep the slope but for steps of a layer. A relief of more than 3 mm stays where it is.
        """
        moved = heights
        if not self._deep:
            moved = moved - self._whole((heights - self._original).mean())
            moved = moved - min(0.0, float(self._whole(moved.min())))
            above = max(0.0, float(self._whole(moved.max())) - self._top)
            moved = moved - min(above, float(self._whole(moved.min())))
            moved = np.maximum(moved, min(float(moved.max()), self._top) - self._relief_mm)
        return self._kept(self._limits.eased(np.clip(moved, self._floor, self._top)))

    def _kept(self, heights: Array) -> Array:
        return heights if self._frozen is None else np.where(self._frozen, self._original, heights)

    def _whole(self, heights: Array | float) -> Array:
        # As `relief.printed.in_layers`: a layer is solid from its middle on.
        return np.asarray(np.floor(np.asarray(heights) / self._layer_mm + 0.5) * self._layer_mm)
