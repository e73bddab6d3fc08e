"""Whole layers: steps toward reliefs that a printer makes exactly.

The original is as printed, and a change by whole layers keeps all its steps where they are. The relief that
counts is rounded to whole layers, but rounding alone puts new steps anywhere. So once the targets are met,
each height is drawn to the nearest layer, by a weight that grows from step to step, while look and touch are
kept: new steps then go where the pictures show them least.
"""

from collections.abc import Mapping

import numpy as np

from optimize.descent.driver import Remembered
from relief.arrays import Array
from relief.limits import HEIGHT_LIMIT_MM

FIRST, GROWTH, LARGEST = 3.0, 3.0, 1e5
"""First weight of the squared distances to the nearest layers, its factor from step to step, and its bound.
With a factor of 2 from 1 on, the change of gravel falls by 1 % more in twice the steps."""
PATIENCE = 2
"""Steps without progress after which such a descent has converged: heights near no layer yet gain little."""
HEIGHTS, WEIGHT = "unrounded", "layer_weight"
"""Names in the memory of an iterate: its heights before rounding, (rows, cols) mm, and the weight, (1,)."""


class Layers:
    """Whole layers of a printer, counted from height 0.

    Args:
        original: (rows, cols) mm, of whole layers.
        layer_mm: thickness of a layer, mm.
    """

    def __init__(self, original: Array, layer_mm: float) -> None:
        self._original, self._layer_mm = original, layer_mm
        self._top = float(np.floor(HEIGHT_LIMIT_MM / layer_mm + 1e-9)) * layer_mm

    @staticmethod
    def remembered(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, Remembered]:
        """What the parts of a memory that this module writes have to be; none where it wrote none."""
        expected = {
            HEIGHTS: Remembered((heights.shape[0], heights.shape[1]), 0.0, HEIGHT_LIMIT_MM),
            WEIGHT: Remembered((1,), 0.0, LARGEST),
        }
        return expected if expected.keys() & memory.keys() else {}

    def rounded(self, heights: Array) -> Array:
        """The nearest heights of whole layers, (rows, cols) mm."""
        return np.asarray(np.clip(self._whole(heights), 0.0, self._top))

    def to_nearest(self, heights: Array) -> Array:
        """(samples,) mm from each height to the nearest layer."""
        return np.asarray((self.rounded(heights) - heights).ravel())

    def placed(self, heights: Array) -> Array:
        """Heights moved by whole layers, to the original's mean and into the limits; what is left is cut."""
        moved = heights - self._whole((heights - self._original).mean())
        moved = moved - min(0.0, float(self._whole(moved.min())))
        above = max(0.0, float(self._whole(moved.max())) - self._top)
        moved = moved - min(above, float(self._whole(moved.min())))
        return np.asarray(np.clip(moved, 0.0, self._top))

    @staticmethod
    def next_weight(weight: float, met: bool) -> float:
        """The weight of the step after one by this weight: none until the targets are met, then growing."""
        return min(LARGEST, max(FIRST, GROWTH * weight)) if weight > 0.0 or met else 0.0

    def _whole(self, heights: Array | float) -> Array:
        # As `relief.export.printers.in_layers`: a layer is solid from its middle on.
        return np.asarray(np.floor(np.asarray(heights) / self._layer_mm + 0.5) * self._layer_mm)
