"""How a print lies in its scan: turned, shifted, shrunk, stretched, tilted, bowed, blurred and higher."""

from dataclasses import dataclass, fields
from math import atan2, cos, degrees, exp, sin
from typing import Self

import numpy as np

from relief.ground.arrays import Array


@dataclass(frozen=True)
class Pose:
    """A print in its scan: height = height_scale * (blurred design)(p) + level + tilt * p + bow(p).

    A point p of the design, mm from its middle, lies in the scan at scale * R(turn) S p + shift from the
    middle of the scan; y is upward, and turns are counter-clockwise. S is symmetric and turns nothing: its
    diagonal is exp(stretch) and exp(-stretch), and both other entries are skew.

    Attributes:
        turn: radians.
        log_scale: natural logarithm of the scale in the plane.
        shift_x_mm, shift_y_mm: of the middle of the design.
        variance_mm2: of the blur that turns the design into the print, in the plane of the design.
        height_scale: of heights.
        level_mm: of the mean height of the design.
        tilt_x, tilt_y: slopes along x and y of the design.
        stretch, skew: of S; an equal scale along all directions has neither.
        bow_xx, bow_xy, bow_yy: factors of x², xy and y² of a bow, 1/mm.
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
    stretch: float = 0.0
    skew: float = 0.0
    bow_xx: float = 0.0
    bow_xy: float = 0.0
    bow_yy: float = 0.0

    @property
    def scale(self) -> float:
        """Lengths in the plane of the print over those of its design; with a stretch, the geometric mean."""
        return float(np.exp(self.log_scale))

    @property
    def longest_degrees(self) -> float:
        """Direction of the greatest stretch, from x of the design, counter-clockwise; 0 to 180."""
        return 0.5 * degrees(atan2(self.skew, self.stretch)) % 180.0

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
        return self.unstretched(c * x + s * y, c * y - s * x)

    def on_scan(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Points of the scan at points of the design; the inverse of `on_design`."""
        c, s = cos(self.turn) * self.scale, sin(self.turn) * self.scale
        x, y = exp(self.stretch) * x + self.skew * y, self.skew * x + exp(-self.stretch) * y
        return c * x - s * y + self.shift_x_mm, s * x + c * y + self.shift_y_mm

    def unstretched(self, x: Array, y: Array) -> tuple[Array, Array]:
        """The inverse of S, of x and y."""
        area = 1.0 - self.skew**2
        return (exp(-self.stretch) * x - self.skew * y) / area, (exp(self.stretch) * y - self.skew * x) / area

    def base(self, x: Array, y: Array) -> Array:
        """Level, tilt and bow at points of the design, mm."""
        return self.level_mm + self.tilt_x * x + self.tilt_y * y + self.bow(x, y)

    def bow(self, x: Array, y: Array) -> Array:
        """The bow at points of the design, mm; 0 in its middle."""
        return self.bow_xx * x**2 + self.bow_xy * x * y + self.bow_yy * y**2


NAMES = tuple(field.name for field in fields(Pose))
"""Names of the numbers of a pose, in their order."""
STRETCHES, BOWS = ("stretch", "skew"), ("bow_xx", "bow_xy", "bow_yy")
"""Names of the numbers that most prints have none of."""
PLAIN = tuple(name for name in NAMES if name not in STRETCHES + BOWS)
"""Names of the others."""
