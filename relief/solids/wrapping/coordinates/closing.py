"""Closing of tiles around a body: a small turn and scale, so that a whole number of tiles goes around."""

from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array
from relief.solids.wrapping.placement import turned

NEAREST = 2
"""Largest difference, in periods, of the ways that are tried from the nearest, along each side of a tile."""
STRAIGHT_DEG = 1e-6
"""Angle, degrees, up to which a turn is a multiple of 90; such a turn is kept exactly."""

LEAST_SCALE, LEAST_TURN_DEG = 0.001, 0.05
"""Relative change of size, and change of direction, degrees, up to which no line is written."""


@dataclass(frozen=True)
class Closing:
    """How a tile closes around a body.

    Attributes:
        scale: Factor of the tile's size: around the body alone where the tile lies upright, else of both its
            sides. Along the body the size is then right, and 5 % change the feel of gravel by 0.1
            just-noticeable differences instead of 0.2.
        turn_deg: Angle by which the tile is turned, degrees.
        across, up: Periods along the tile's width and height that the way around passes.
    """

    scale: float
    turn_deg: float
    across: int
    up: int

    @property
    def matrix(self) -> Array:
        """(2, 2) from coordinates in the surface, mm, to those in the tile, mm."""
        upright = not (self.across and self.up)
        return turned(self.turn_deg) / (self.scale, 1.0 if upright else self.scale)


def closed(around_mm: float, turn_deg: float, width_mm: float, height_mm: float) -> Closing:
    """The nearest size and turn of a tile with which it closes.

    The way around has to be a vector of the lattice of the tile. Of the lattice vectors near the way wanted,
    the best has the least sum of squares of the logarithm of the ratio of lengths and of the angle in
    radians.

    Args:
        around_mm: Way around the body, mm; infinite where none leads around it, and nothing has to close.
        turn_deg: Angle wanted, degrees.
        width_mm: Of the tile.
        height_mm: Of the tile.
    """
    best, least = Closing(1.0, turn_deg, 0, 0), np.inf
    if not np.isfinite(around_mm):
        return best
    wanted = turned(turn_deg) @ np.array([around_mm, 0.0])
    steps = np.arange(-NEAREST, NEAREST + 1)
    middle = np.round(wanted / (width_mm, height_mm)).astype(int)
    straight = abs((turn_deg + 45.0) % 90.0 - 45.0) <= STRAIGHT_DEG
    for across in middle[0] + steps:
        for up in middle[1] + steps:
            way = np.array([across * width_mm, up * height_mm])
            length = float(np.linalg.norm(way))
            if length == 0.0 or float(way @ wanted) <= 0.0:
                continue
            off = float(np.degrees(np.arctan2(way @ (-wanted[1], wanted[0]), way @ wanted)))
            if straight and abs(off) > STRAIGHT_DEG:
                continue
            cost = np.log(length / around_mm) ** 2 + np.radians(off) ** 2
            if cost < least:
                best, least = Closing(around_mm / length, turn_deg - off, int(across), int(up)), cost
    return best


def change_line(closing: Closing, size_mm: tuple[float, float], turn_deg: float, name: str) -> str:
    """A line about what closing changes; empty if the changes are invisible.

    Args:
        closing: Scale and turn of the tile.
        size_mm: Height and width of the tile.
        turn_deg: Angle that the placement states.
        name: Name of the chart.
    """
    across, up = abs(closing.across), abs(closing.up)
    period = size_mm[1] if across else size_mm[0]
    changes = []
    if abs(closing.scale - 1.0) > LEAST_SCALE:
        changes.append(f"period {closing.scale * period:.3g} mm instead of {period:.3g}")
    if abs(closing.turn_deg - turn_deg) > LEAST_TURN_DEG:
        changes.append(f"turned by {closing.turn_deg:.1f} degrees instead of {turn_deg:g}")
    if not changes:
        return ""
    count = across or up
    goes = f"{count} {'goes' if count == 1 else 'go'} around"
    if across and up:
        goes = f"{across} across and {up} up go around"
    return f"{name}: {' and '.join(changes)}, so that {goes}"
