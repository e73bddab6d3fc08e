"""Resampling: the square of a picture that becomes the plate, its grey, and the samples of a height map."""

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.preparing.choices import GREYS, Box
from relief.reading.samples import Samples


def square_in(width: int, height: int, crop: Box | None = None, centre: int | None = None) -> Box:
    """The square that becomes the plate: the largest one in the middle of a part of a picture.

    Args:
        width: Of the picture, pixels.
        height: Of the picture, pixels.
        crop: x and y of the upper left corner, width and height of the part, in pixels; None is the whole.
        centre: Side of a smaller square in the middle, pixels.

    Returns:
        Its left, upper, right and lower edge.

    Raises:
        InputError: The part reaches out of the picture, or the square is larger than the part.
    """
    left, upper, wide, high = (0, 0, width, height) if crop is None else crop
    inside = 0 <= left <= left + wide <= width and 0 <= upper <= upper + high <= height
    if not inside or min(wide, high) < 1:
        numbers = ",".join(str(number) for number in (left, upper, wide, high))
        raise InputError(f"crop: {numbers} is no part of a picture of {width} x {height} pixels")
    side = min(wide, high)
    if centre is not None:
        if not 1 <= centre <= side:
            raise InputError(f"centre: {centre} is no side of a square in {wide} x {high} pixels")
        side = centre
    left, upper = left + (wide - side) // 2, upper + (high - side) // 2
    return left, upper, left + side, upper + side


def resampled(
    values: NDArray[np.float32], samples: int, side: float | None = None, start: float = 0.0
) -> Array:
    """Bring a square of an array to another number of samples.

    To fewer samples, each one is a mean weighted by a triangle two samples wide: detail too fine for the
    samples fades. To more samples, by cubic interpolation. No sample leaves the range of the pixels.

    Args:
        values: (rows, cols).
        samples: Samples a side of the result.
        side: Side of the square in pixels, any number up to that of the array; all of it if None.
        start: Distance of the square from the left and the upper edge of the array, pixels. Means at the
            edges of the square reach beyond it.

    Returns:
        (samples, samples).
    """
    side = float(min(values.shape)) if side is None else side
    if side == samples and start == int(start):
        part = slice(int(start), int(start) + samples)
        return values[part, part].astype(np.float64)
    low, high = float(values.min()), float(values.max())
    # Pillow computes in single precision: numbers far from 0, such as elevations, keep their digits so.
    unit = (high - low) or 1.0
    image = Image.fromarray((values - np.float32(low)) / np.float32(unit))
    method = Image.Resampling.BILINEAR if side > samples else Image.Resampling.BICUBIC
    shrunk = image.resize((samples, samples), method, box=(start, start, start + side, start + side))
    # Cubic interpolation overshoots at edges, for example beyond white.
    return low + unit * np.clip(np.asarray(shrunk, dtype=np.float64), 0.0, 1.0)


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
