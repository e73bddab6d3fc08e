"""The request of a palette: what `palette.toml` in its folder holds, checked before any work begins."""

from typing import Annotated

from pydantic import Field

from retouch.laboratory.stimulus_sets.plate_set import FilePath, PlateSet

MOST_FILLS = 16
"""Most fills, and most textures, of a palette."""


class Palette(PlateSet):
    """`palette.toml`.

    Attributes:
        apart: least just-noticeable differences (JND) of roughness between any two fills.
        fills: number of fills; None: one of each texture, or of one texture as many as there is room for.
        one_finger: whether only the given finger is to tell fills apart, not a range of fingers.
    """

    FILE = "palette.toml"
    KIND = "palette"

    textures: Annotated[tuple[FilePath, ...], Field(strict=False, min_length=1, max_length=MOST_FILLS)]
    apart: Annotated[float, Field(ge=0.5, le=10.0)]
    fills: Annotated[int, Field(ge=2, le=MOST_FILLS)] | None = None
    one_finger: bool = False
