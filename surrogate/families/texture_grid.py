"""Grids: where a family's texture is sampled, on a plate or on one period of a tile."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from relief.ground.limits import PATCH_SIDE_MM

Period = tuple[float, float] | None
"""Periods along x and y, mm; None on a plate, where nothing repeats."""

_MARGIN = 1.25
"""Period of random fields, in plates; a crop of one plate shows no period."""
_Number = TypeVar("_Number", float, NDArray[np.float64])


@dataclass(frozen=True)
class Grid:
    """Square samples of a square.

    Attributes:
        samples: Samples a side.
        side_mm: Side, mm.
        periodic: Whether the texture goes on as itself beyond the square along both axes.
    """

    samples: int
    side_mm: float = PATCH_SIDE_MM
    periodic: bool = False

    @property
    def pitch_mm(self) -> float:
        """Distance between neighbouring samples, mm."""
        return self.side_mm / self.samples

    @property
    def plates(self) -> float:
        """Area in plates of the usual side."""
        return (self.side_mm / PATCH_SIDE_MM) ** 2

    @property
    def field_samples(self) -> int:
        """Samples a side of a random field, which is periodic: those of a tile, and more than a plate's."""
        return self.samples if self.periodic else int(np.ceil(self.samples * _MARGIN / 4)) * 4

    def period(self, squeeze: float = 1.0) -> Period:
        """Periods of coordinates of which x was divided by ``squeeze``."""
        return (self.side_mm / squeeze, self.side_mm) if self.periodic else None

    def direction(self, angle: float) -> float:
        """The angle (radians), on a tile the nearest one along an axis."""
        return float(np.rint(2 * angle / np.pi)) * np.pi / 2 if self.periodic else angle

    def offset(self, distance: _Number) -> _Number:
        """Distances along an axis, mm, on a tile those to the nearest repeat."""
        if not self.periodic:
            return distance
        return (distance + self.side_mm / 2) % self.side_mm - self.side_mm / 2
