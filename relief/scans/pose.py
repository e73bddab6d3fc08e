"""How a print lies in its scan: turned, shifted, shrunk, tilted, blurred, and higher or lower."""

from dataclasses import dataclass, fields
from math import cos, sin
from typing import Self

import numpy as np

from relief.ground.arrays import Array


@dataclass(frozen=True)
class Pose:
    """A print in its scan: height = height_scale * (blurred design)(p) + level + tilt * p.

    A point p of the design, mm from its middle, lies in the scan at scale * R(turn) p + shift from the
    middle of the scan; y is upward, and turns are counter-clockwise.

    Attributes:
        turn: radians.
        log_scale: natural logarithm of the scale in the plane.
        shift_x_mm, shift_y_mm: of the middle of the design.
        variance_mm2: of the blur that turns the design into the print, in the plane of the design.
        height_scale: of heights.
        level_mm: of the mean height of the design.
        tilt_x, tilt_y: slopes along x and y of the design.
    """

    turn: float = 0.0
    log_scale: float = 0.0
    shift_x_mm: float = 0.0
    shift_y_mm: float = 0.0
    variance_mm2: float = 0.0
    height_scale: float = 1.0
    level_mm: float = 0.0
    tilt_x: float = 0.0
    tilt_y: float = 0.0

    @property
    def scale(self) -> float:
        """Lengths in the plane of the print over those of its design."""
        return float(np.exp(self.log_scale))

    def array(self) -> Array:
        """The numbers in their order."""
        return np.array([getattr(self, field.name) for field in fields(self)])

    @classmethod
    def of(cls, numbers: Array) -> Self:
        """The pose of an array of numbers; the inverse of `array`."""
        return cls(*(float(number) for number in numbers))

    def on_design(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Points of the design at points of the scan, mm from the middle of either."""
        x, y, scale = x - self.shift_x_mm, y - self.shift_y_mm, self.scale
        c, s = cos(self.turn) / scale, sin(self.turn) / scale
        return c * x + s * y, c * y - s * x

    def on_scan(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Points of the scan at points of the design; the inverse of `on_design`."""
        c, s = cos(self.turn) * self.scale, sin(self.turn) * self.scale
        return c * x - s * y + self.shift_x_mm, s * x + c * y + self.shift_y_mm


NAMES = tuple(field.name for field in fields(Pose))
"""Names of the numbers of a pose, in their order."""
