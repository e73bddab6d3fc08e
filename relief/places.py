"""Contact locations on a surface, called places, and the patches of the relief under the finger.

A place is the row and column of the first sample of a patch. On an axis that repeats, places cover one period
evenly and patches wrap around the period; on other axes every patch lies wholly on the
plate, and places run evenly from edge to edge.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.arrays import Index
from relief.ground.limits import PATCH_SIDE_MM
from relief.surface import Surface

SPACING_MM = 2.5
"""Greatest distance between neighbouring places, mm: between places 3.3 mm apart a result was up to 0.39
just-noticeable differences off."""
ROUND_SPACING_MM = 2.0
"""`SPACING_MM` of a round finger, whose contact is smaller: with 2.5 mm four of twenty tiles were 0.26 to
0.45 just-noticeable differences off between the places, with 2.0 mm 0.16 to 0.24."""
_ROUNDING = 1e-6
"""Share of a spacing, or of a sample, by which a quotient of lengths may exceed a whole number."""


def patch_shape(surface: Surface) -> tuple[int, int]:
    """Rows and columns of a finger's patch, which is square.

    The patch has 10 mm, or the shorter side of the plate if that is less; a tile may be smaller than the
    patch along an axis on which it repeats.
    """
    bounds = [n for n, repeats in zip(surface.shape, surface.repeats, strict=True) if not repeats]
    side = min([math.ceil(PATCH_SIDE_MM / surface.pitch_mm - _ROUNDING), *bounds])
    return side, side


def places(surface: Surface, spacing_mm: float = SPACING_MM) -> Index:
    """Places on a lattice.

    Args:
        surface: to be touched.
        spacing_mm: greatest distance between neighbours along an axis, mm.

    Returns:
        (k, 2) row and column of the first sample of each patch, row by row; one place, (0, 0), on a plate
        that does not repeat and is no larger than the patch.
    """
    return _lattice(*_starts(surface, spacing_mm))


def between(surface: Surface, spacing_mm: float = SPACING_MM) -> Index:
    """Places in the middle between those of `places`.

    Returns:
        (k, 2) as of `places`, with each axis halfway between neighbours, or where `places` has only one place
        on the axis, at that place; no rows if there is one place in all.
    """
    starts = _starts(surface, spacing_mm)
    if all(len(of_axis) == 1 for of_axis in starts):
        return np.zeros((0, 2), dtype=np.int64)
    middles = []
    for first, n, repeats in zip(starts, surface.shape, surface.repeats, strict=True):
        following = np.append(first[1:], first[0] + n) if repeats else first[1:]
        ahead = first[: len(following)]
        middles.append((ahead + following) // 2 if len(following) else first)
    return _lattice(*middles)


def centres_mm(surface: Surface, places: Index) -> NDArray[np.float64]:
    """(k, 2) distance of each patch's centre from the first row's and first column's outer edge, mm.

    On an axis that repeats, the distance lies within one period.
    """
    centres = (places + 0.5 * np.array(patch_shape(surface))) * surface.pitch_mm
    for axis, (size, repeats) in enumerate(zip(surface.size_mm, surface.repeats, strict=True)):
        if repeats:
            centres[:, axis] %= size
    return np.asarray(centres)


def cut(heights: Any, places: Index, shape: tuple[int, int]) -> Any:
    """Patches of a relief at places, by indices that wrap around.

    Args:
        heights: (rows, cols), an array or a tensor.
        places: (k, 2).
        shape: rows and columns of a patch.

    Returns:
        (k, *shape), an array or a tensor like `heights`.
    """
    sizes = zip(places.T, shape, heights.shape, strict=True)
    rows, cols = ((first[:, None] + np.arange(count, dtype=np.int64)) % size for first, count, size in sizes)
    return heights[rows[:, :, None], cols[:, None, :]]


def _starts(surface: Surface, spacing_mm: float) -> list[Index]:
    """First rows and first columns of the lattice."""
    spacing, patch = spacing_mm / surface.pitch_mm, patch_shape(surface)
    starts = []
    for n, side, repeats in zip(surface.shape, patch, surface.repeats, strict=True):
        room = n if repeats else n - side
        steps = math.ceil(room / spacing - _ROUNDING)
        count = steps if repeats else steps + 1
        numbers = np.arange(min(count, room + (not repeats)), dtype=np.float64)
        stride = room / max(len(numbers) - (not repeats), 1)
        starts.append(np.rint(numbers * stride).astype(np.int64))
    return starts


def _lattice(rows: Index, cols: Index) -> Index:
    grid = np.meshgrid(rows, cols, indexing="ij")
    return np.stack([axis.ravel() for axis in grid], axis=-1)
