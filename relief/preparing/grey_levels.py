"""Levels: the values of a picture that become the lowest and the highest height."""

from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.ground.lengths import shown

WHITE = 255.0
"""White, in the unit of levels of pictures, as in picture editors."""


@dataclass(frozen=True)
class Levels:
    """Two values of a picture.

    Attributes:
        low, high: Percentiles; or grey from 0 (black) to 255 (white); or numbers of a file of numbers.
        percent: Whether they are percentiles.
    """

    low: float
    high: float
    percent: bool

    @classmethod
    def read(cls, text: str) -> "Levels":
        """Read "LOW,HIGH" or "LOW%,HIGH%". Raises InputError."""
        parts = [part.strip() for part in text.split(",")]
        percent = all(part.endswith("%") for part in parts)
        try:
            low, high = (float(part.removesuffix("%") if percent else part) for part in parts)
        except ValueError:
            low = high = np.nan
        if not (low < high and np.isfinite([low, high]).all()) or (
            percent and not 0.0 <= low < high <= 100.0
        ):
            raise InputError(
                f"levels: {shown(text)!r} is not LOW,HIGH or LOW%,HIGH%, as in 20,230 or 0.5%,99.5%"
            )
        return cls(low, high, percent)

    def values(self, grey: AnyArray, white: float) -> tuple[float, float]:
        """The two values in the unit of an array in which white is 1 and levels count up to ``white``.

        Raises:
            InputError: They are the same, as in a picture of one grey.
        """
        if self == FULL:
            low, high = float(grey.min()), float(grey.max())
        elif self.percent:
            low, high = (float(value) for value in np.percentile(grey, [self.low, self.high]))
        else:
            low, high = self.low / white, self.high / white
        if not high > low:
            raise InputError("is flat: what would be lowest and highest has one grey")
        return low, high


FULL = Levels(0.0, 100.0, percent=True)
"""From the darkest to the brightest pixel."""
AS_STORED = Levels(0.0, WHITE, percent=False)
"""From black to white."""
