"""Colour maps and PNG pictures of arrays as data URIs, and hill shading."""

import base64
import io
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from relief.ground.arrays import FloatArray
from relief.ground.srgb import srgb
from relief.relief_shading import averaged, facing

Table = NDArray[np.uint8]


def colour_table(points: Sequence[str]) -> Table:
    """A table of 256 colours, (256, 3), interpolated between equally spaced colours such as "1a2b3c"."""
    knots = np.array([[int(point[k : k + 2], 16) for k in (0, 2, 4)] for point in points])
    positions = np.linspace(0.0, len(points) - 1.0, 256)
    channels = [np.interp(positions, np.arange(len(points)), knots[:, k]) for k in range(3)]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


# Viridis: S. van der Walt and N. Smith (CC0). PuOr and YlGnBu: C. Brewer, colorbrewer2.org (Apache 2.0).
# The order of the colours stays visible with the common colour-vision deficiencies.
VIRIDIS = colour_table(
    ("440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725")
)
PURPLE_ORANGE = colour_table(
    (
        *("2d004b", "542788", "8073ac", "b2abd2", "d8daeb", "f7f7f7"),
        *("fee0b6", "fdb863", "e08214", "b35806", "7f3b08"),
    )
)
YELLOW_BLUE = colour_table(
    ("ffffd9", "edf8b1", "c7e9b4", "7fcdbb", "41b6c4", "1d91c0", "225ea8", "253494", "081d58")
)
GREY = colour_table(("000000", "ffffff"))
NO_VALUE = (0xDD, 0xDA, 0xD4)
"""Colour of what has no value, as a place out of contact has no pressure: a grey of no table."""
SHOWN_SIDE = 512
"""Longest side of a picture, pixels; on a page it is about 360 points long."""


def picture_uri(radiance: FloatArray, white: float, side: int) -> str:
    """A picture of linear radiance, at most `side` pixels long; `white` is full white.

    Args:
        radiance: (rows, cols), or (rows, cols, 3) in RGB.
    """
    channels = np.moveaxis(radiance[..., None] if radiance.ndim == 2 else radiance, -1, 0)
    small = np.stack([averaged(channel, side) for channel in channels], axis=-1)
    return _png(srgb(small.squeeze(-1) if radiance.ndim == 2 else small, white) * 255.0, GREY)


def map_uri(values: FloatArray, low: float, high: float, table: Table, side: int) -> str:
    """A map (rows, cols) in the colours of a table from `low` to `high`, at most `side` pixels long."""
    return _png((averaged(values, side) - low) / (high - low) * 255.0, table)


def gaps_uri(values: FloatArray, low: float, high: float, table: Table) -> str:
    """A map (rows, cols) in the colours of a table from `low` to `high`, grey where a value is NaN."""
    table = table.copy()
    table[0] = NO_VALUE
    places = np.clip(1.0 + (values - low) / (high - low) * 254.0, 1.0, 255.0)
    return _png(np.where(np.isfinite(values), places, 0.0), table)


def hillshade(heights: FloatArray, size_mm: float) -> FloatArray:
    """Lambert shading in [0, 1] of heights, mm, both (rows, cols); light from the top left, 45 degrees up."""
    return np.clip(facing(heights, size_mm, 135.0, 45.0), 0.0, 1.0)


def shade_uri(heights: FloatArray, size_mm: float) -> str:
    """A picture of the hill shading of heights, mm, (rows, cols)."""
    return picture_uri(hillshade(heights, size_mm), 1.4, SHOWN_SIDE)


def bar_uri(table: Table) -> str:
    """A picture of a table's colours from left to right, one pixel high."""
    return _png(np.arange(256.0)[None, :], table)


def _png(indices: FloatArray, table: Table) -> str:
    image = Image.fromarray(np.clip(indices.round(), 0, 255).astype(np.uint8))
    if table is not GREY:
        image.putpalette(table.tobytes())
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")
