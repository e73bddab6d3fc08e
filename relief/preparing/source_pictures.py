"""Grey values of what a file holds, and the steps between them."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.preparing.choices import GREYS
from relief.reading.samples import Samples


def grey_values(picture: Samples, box: tuple[int, int, int, int], grey: str) -> NDArray[np.float32]:
    """Grey values of a part of a picture.

    Args:
        picture: what a file holds.
        box: left, upper, right and lower edge in pixels, inside the picture.
        grey: a key of `GREYS`; only "alpha" matters to a picture that is grey already.

    Returns:
        (rows, cols) values in [0, 1], transparent parts 1; of a file of numbers, the numbers, NaN where
        nothing was measured.

    Raises:
        InputError: the picture lacks the channel.
    """
    left, upper, right, lower = box

    def band(name: str) -> NDArray[np.float32]:
        part = picture.channels[name][upper:lower, left:right]
        return part.astype(np.float32) / np.float32(picture.white)

    weights = GREYS[grey] if picture.coloured or grey == "alpha" else {"Y": 1.0}
    if missing := weights.keys() - picture.channels.keys():
        raise InputError(f"grey: {grey}: the picture has no channel {min(missing)}")
    total = np.zeros((lower - upper, right - left), np.float32)
    for name, weight in weights.items():
        total += np.float32(weight) * band(name)
    if picture.bits is not None and grey != "alpha" and "A" in picture.channels:
        total = 1.0 - (1.0 - total) * band("A")
    return total


def grey_step(picture: Samples) -> float | None:
    """Difference of neighbouring grey values if white is 1, or None where there are no steps to smooth.

    A picture of two values is a drawing without slopes. A file of 16 bits may hold a picture of fewer bits.
    """
    if picture.bits is None or picture.bits == 1:
        return None
    if picture.bits <= 8:
        return 1.0 / (2.0**picture.bits - 1.0)
    return None if picture.coloured else _common_gap(picture.channels, picture.white)


def _common_gap(channels: Mapping[str, AnyArray], white: float) -> float | None:
    held = np.unique(channels["Y"]).astype(np.int64)
    gap = int(np.gcd.reduce(np.diff(held))) if len(held) > 2 else 0
    return gap / white if gap > 1 else None
