"""Checks of a wrapping: ranges of numbers, masks that leave nothing, and reliefs that are too high."""

from collections.abc import Sequence

import numpy as np

from relief.ground.arrays import Array, Flags
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.ground.options import checked
from relief.solids.body import Body
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.masks import Regions, check_mask

FEW_SAMPLES = 4
"""Side of the least square that carries a texture, in its samples."""
MOST_LEFT_BARE = 0.5
"""Largest share of the textured area without relief; beyond, the relief does not fit."""
BARE = 0.1
"""Factor of the heights below which an area counts as without relief."""


def check_choices(
    settings: Settings, masks: Sequence[str | None], regions: Regions, with_uv: bool, with_colours: bool
) -> None:
    """Refuse numbers out of range and invalid masks, before the surface is known.

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
    """Refuse a body smaller than the height of the relief."""
    longest = float(np.ptp(body.vertices, axis=0).max())
    if longest < tallest:
        fault = f"size: {longest:.3g} mm is less than the {tallest:.3g} mm of the relief"
        raise InputError(
            f"{fault}; state the unit of the mesh (units), or take a lower relief (relief_mm)",
            f"{fault}; state the unit of the mesh (--units), or take a lower relief (--relief-mm)",
        )


def check_area(body: Body, carried: Array, pitch_mm: float, mask: str | None) -> None:
    """Refuse a texture on an area of less than a few samples, by its shares at vertices (n,)."""
    area = float((body.areas * carried[body.faces].mean(axis=1)).sum())
    least = (FEW_SAMPLES * pitch_mm) ** 2
    if area < least:
        named = "mask" if mask is None else f"mask: {shown(mask)}"
        raise InputError(
            f"{named}: leaves nothing of the surface to the texture, or {area:.2g} mm², where it needs "
            f"{least:.2g} mm² at least; take a wider mask or a smaller falloff"
        )


def check_room(body: Body, where: Flags, factor: Array, tallest: float) -> None:
    """Refuse a relief that is lowered to nothing on most of the textured area.

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
