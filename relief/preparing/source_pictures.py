"""Grey values of what a file holds."""

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.preparing.choices import GREYS
from relief.reading.samples import Samples


def grey_values(picture: Samples, box: tuple[int, int, int, int], grey: str) -> NDArray[np.float32] | Array:
    """Grey values of a part of a picture.

    Args:
        picture: what a file holds.
        box: left, upper, right and lower edge in pixels, inside the picture.
        grey: a key of `GREYS`; only "alpha" matters to a picture that is grey already.

    Returns:
        (rows, cols) values in [0, 1], transparent parts 1; of a file of numbers, the numbers, NaN where
        nothing was measured. In double precision where a channel has more than single precision holds.

    Raises:
        InputError: the picture lacks the channel.
    """
    left, upper, right, lower = box

    # Single precision for 8 and 16 bits, since pictures are large.
    kind = np.result_type(np.float32, *(channel.dtype for channel in picture.channels.values()))

    def band(name: str) -> NDArray[np.float32] | Array:
        part = picture.channels[name][upper:lower, left:right]
        return part.astype(kind) / kind.type(picture.white)

    weights = GREYS[grey] if picture.coloured or grey == "alpha" else {"Y": 1.0}
    if missing := weights.keys() - picture.channels.keys():
        raise InputError(f"grey: {grey}: the picture has no channel {min(missing)}")
    total = np.zeros((lower - upper, right - left), kind)
    for name, weight in weights.items():
        total += kind.type(weight) * band(name)
    if picture.bits is not None and grey != "alpha" and "A" in picture.channels:
        total = 1.0 - (1.0 - total) * band("A")
    return total
