"""Texture coordinates of a mesh as flat coordinates in mm, where they keep sizes."""

import numpy as np

from relief.ground.arrays import Array, Flags
from relief.solids.body import Body
from relief.solids.wrapping.coordinates.layout import Layout, one_patch, singular_values

STRETCH = 0.25
"""Largest relative change of a length against the median scale of the coordinates."""
SHARE = 0.95
"""Least share of the area on which coordinates keep lengths within `STRETCH`."""


def by_texture_coordinates(
    body: Body, uv: Array | None, where: Flags, *, any_size: bool = False
) -> Layout | None:
    """The layout by texture coordinates; None if there are none, or if they would change the texture's size.

    Args:
        body: The body.
        uv: (faces, 3, 2) texture coordinates of the corners, in any unit.
        where: (faces,) those that carry texture.
        any_size: Whether they are taken however they change the size.
    """
    if uv is None:
        return None
    corners, areas = body.vertices[body.faces], body.areas
    low, high = (np.abs(value) for value in singular_values(corners, uv))
    order = np.argsort(low[where] * high[where])
    middle = np.searchsorted(np.cumsum(areas[where][order]), 0.5 * areas[where].sum())
    scale = float(np.sqrt((low * high)[where][order][middle]))
    if not scale > 0.0:
        return None
    stretch = np.maximum(high / scale - 1.0, 1.0 - low / scale)
    if not any_size and areas[where & (stretch <= STRETCH)].sum() < SHARE * areas[where].sum():
        return None
    return one_patch(where, uv / scale, stretch)
