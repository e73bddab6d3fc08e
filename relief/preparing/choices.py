"""Options of a preparation; this module imports nothing heavy."""

from collections.abc import Mapping

GREYS: Mapping[str, Mapping[str, float]] = {
    "luminance": {"R": 0.2126, "G": 0.7152, "B": 0.0722},
    "mean": {"R": 1 / 3, "G": 1 / 3, "B": 1 / 3},
    "red": {"R": 1.0},
    "green": {"G": 1.0},
    "blue": {"B": 1.0},
    "alpha": {"A": 1.0},
}
"""Weights of the channels of a coloured picture, as stored, by the name of the grey.

Those of luminance are of ITU-R BT.709.
"""
METHODS = ("blend", "cut")
"""Ways to join the borders of a tile; `relief.preparing.tiling` describes them."""
TURNS = (0, 90, 180, 270)
"""Degrees by which a picture may be turned."""
AUTO = "auto"
"""The way with the smaller seam error."""
MOST_USUAL_SAMPLES = 128
"""Default of the most samples a side: one for each pixel of the pictures of the bundled scenes."""
OUTPUTS = (".png", ".exr")
"""Suffixes of the files that are written."""
