"""What wrapping refuses: numbers out of range, masks that leave nothing, and a relief without room."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.ground.options import checked
from relief.solids.body import Body
from relief.solids.wrapping.masks import Regions, check_mask
from relief.solids.wrapping.surfaces import Settings

FEW_SAMPLES = 4
"""Side, in samples of the texture, of the least square that may carry the texture."""
MOST_LEFT_BARE = 0.5
"""Largest part of the textured area that may be left with nothing; beyond, the relief does not fit."""
BARE = 0.1
"""Factor of the heights up to which nothing is left of a relief."""


def check_choices(
    settings: Settings, masks: Sequence[str | None], regions: Regions, with_uv: bool, with_colours: bool
) -> None:
    """Refuse what is wrong whatever the surface: numbers out of range, and masks that are none.

    Args:
        settings: As for `wrap`.
        masks: Of the coverings.
        regions: As for `wrap`.
        with_uv: Whether the mesh has texture coordinates, or may have.
        with_colours: Whether it has colours, or may have.

    Raises:
        InputError: The line names the field.
    """
    checked(settings)
    for mask in (settings.mask, *masks):
        if mask is not None:
            check_mask(mask, regions, with_uv, with_colours)


def check_size(body: Body, tallest: float) -> None:
    """Refuse a body that is smaller than the relief is tall, which would be but a speck in it."""
    longest = float(np.ptp(body.vertices, axis=0).max())
    if longest < tallest:
        fault = f"size: {longest:.3g} mm is less than the {tallest:.3g} mm of the relief"
        raise InputError(
            f"{fault}; state the unit of the mesh (units), or take a lower relief (relief_mm)",
            f"{fault}; state the unit of the mesh (--units), or take a lower relief (--relief-mm)",
        )


def check_area(body: Body, carried: Array, pitch_mm: float, mask: str | None) -> None:
    """Refuse a texture that is carried by less than a few of its samples, by how much each vertex carries."""
    area = float((body.areas * carried[body.faces].mean(axis=1)).sum())
    least = (FEW_SAMPLES * pitch_mm) ** 2
    if area < least:
        named = "mask" if mask is None else f"mask: {shown(mask)}"
        raise InputError(
            f"{named}: leaves nothing of the surface to the texture, or {area:.2g} mm², where it needs "
            f"{least:.2g} mm² at least; take a wider mask or a smaller falloff"
        )


def check_room(body: Body, where: NDArray[np.bool_], factor: Array, tallest: float) -> None:
    """Refuse a relief of which nothing is left on most of the textured area.

    Args:
        body: The surface.
        where: (faces,) triangles that carry texture.
        factor: (vertices,) factors of the heights.
        tallest: Height of the relief, mm.
    """
    areas, least = body.areas[where], factor[body.faces[where]].min(axis=1)
    bare = float(areas[least < BARE].sum() / areas.sum())
    if bare > MOST_LEFT_BARE:
        raise InputError(
            f"relief: {tallest:.3g} mm is too high for this object: on {100 * bare:.0f} % of the area its "
            "curvature or thickness leaves less than a tenth; take a lower relief (--relief-mm) or a larger "
            "object"
        )
