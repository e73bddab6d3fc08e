"""Export of height maps as closed bodies, to print and to model with."""

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.ground.limits import BASE_MM, LARGEST_PLATE_MM, LARGEST_SIDE, SMALLEST_PLATE_MM
from relief.ground.progress import stage
from relief.plate_grid import grid_axes, grid_faces, pad_index
from relief.seam import check_seams
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts

FLAT_SHARE = 0.8
"""Flat part of a pixel's side on a stepped plate; slicers then give each pixel its own height."""


RAISED_MM = 1e-3
"""Excess height of a stepped plate over its layers, mm: slicers drop a top layer that rounding makes too low,
as PrusaSlicer 2.5 does where a plate of 2.6 mm is 2.5999999 mm in single precision."""


def plate_mesh(
    heights_mm: ArrayLike, size_mm: float, base_mm: float = BASE_MM, stepped: bool = False
) -> Body:
    """Build a textured plate as one watertight body with outward normals.

    The relief is the triangulation that is rendered: samples at pixel centres, repeated outward to the rim.
    For heights as a printer makes them that is not enough: a slicer reads the slopes between its pixels, and
    gives one in twenty another layer. A stepped plate is flat around each sample, with walls between, and
    1 um higher, so that no layer is lost to rounding.

    Args:
        heights_mm: (rows, cols) heights in mm, row 0 at +y, column 0 at -x; z = 0 is the top of the base.
        size_mm: Width of the plate, mm.
        base_mm: Thickness under z = 0, mm; the bottom is flat at z = -base_mm.
        stepped: Whether each sample is a flat pixel.

    Returns:
        A body of (rows + 2)(cols + 2) vertices on the relief, a ring below its rim, one bottom centre. A
        stepped plate has twice the rows and columns.

    Raises:
        InputError: The heights are no finite 2-D array or reach the bottom, or size or base is out of range.
    """
    heights = _checked(heights_mm, size_mm, base_mm)
    if stepped:
        heights = RAISED_MM + heights.repeat(2, axis=0).repeat(2, axis=1)
    rows, cols = heights.shape
    x, y = grid_axes(rows, cols, size_mm)
    if stepped:
        # The two samples of a pixel lie a quarter of it on either side of its middle.
        outward = np.array([-1.0, 1.0]) * (0.5 * FLAT_SHARE - 0.25) * (2.0 * size_mm / cols)
        x[1:-1] += np.tile(outward, cols // 2)
        y[1:-1] -= np.tile(outward, rows // 2)
    x, y = (along.ravel() for along in np.meshgrid(x, y))
    relief = np.column_stack([x, y, heights.ravel()[pad_index(rows, cols)]])
    rim = _rim(rows + 2, cols + 2)
    foot = relief[rim] * (1.0, 1.0, 0.0) - (0.0, 0.0, base_mm)
    centre = np.array([[0.0, 0.0, -base_mm]])
    below = len(relief) + np.arange(len(rim))
    faces = np.concatenate([grid_faces(rows, cols), _wall_faces(rim, below), _bottom_faces(below)])
    return Body(np.concatenate([relief, foot, centre]), faces)


@stage("writing a plate")
def export_plate(
    path: Path, heights_mm: ArrayLike, size_mm: float, base_mm: float = BASE_MM, stepped: bool = False
) -> Path:
    """Write a plate in the format of the suffix (`relief.solids.export.parts.write_parts`).

    The file appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        heights_mm: As for `plate_mesh`.
        size_mm: Width of the plate, mm.
        base_mm: Thickness under z = 0, mm.
        stepped: As for `plate_mesh`.

    Returns:
        The path.

    Raises:
        InputError: As for `plate_mesh`, and for any other suffix.
    """
    return write_parts(path, [Part("plate", plate_mesh(heights_mm, size_mm, base_mm, stepped))])


def repeated(heights_mm: ArrayLike, times: tuple[int, int], name: object) -> Array:
    """Repeat a tile.

    Args:
        heights_mm: (rows, cols) heights.
        times: How often along y and along x, 1 or more.
        name: The file of the tile, for messages.

    Returns:
        (rows * times[0], cols * times[1]) heights.

    Raises:
        InputError: The sides of the tile do not fit where they would meet, or there are too many samples.
    """
    heights = np.asarray(heights_mm, dtype=np.float64)
    check_seams(heights, (times[0] > 1, times[1] > 1), name)
    rows, cols = heights.shape[0] * times[0], heights.shape[1] * times[1]
    if max(rows, cols) > LARGEST_SIDE:
        raise InputError(
            f"{name}: {times[1]} x {times[0]} tiles have {cols} x {rows} samples; "
            f"at most {LARGEST_SIDE} a side"
        )
    return np.tile(heights, times)


def _checked(heights_mm: ArrayLike, size_mm: float, base_mm: float) -> Array:
    heights = np.asarray(heights_mm, dtype=np.float64)
    if heights.ndim != 2 or heights.size == 0:
        raise InputError(f"heights: expected an array (rows, cols), got shape {heights.shape}")
    if not np.isfinite(heights).all():
        raise InputError(f"heights: {np.count_nonzero(~np.isfinite(heights))} values are not finite")
    if not SMALLEST_PLATE_MM <= size_mm <= LARGEST_PLATE_MM:
        raise InputError(f"size_mm: {size_mm:g} is outside [{SMALLEST_PLATE_MM:g}, {LARGEST_PLATE_MM:g}]")
    if not 0.0 < base_mm <= LARGEST_PLATE_MM:
        raise InputError(f"base_mm: {base_mm:g} is not above 0 and at most {LARGEST_PLATE_MM:g}")
    if heights.min() <= -base_mm:
        raise InputError(
            f"base_mm: the relief reaches {heights.min():g} mm, through a base of {base_mm:g} mm"
        )
    return heights


def _rim(rows: int, cols: int) -> Index:
    """Vertices on the boundary of a grid, counter-clockwise seen from above."""
    index = np.arange(rows * cols).reshape(rows, cols)
    return np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])


def _wall_faces(above: Index, below: Index) -> Index:
    next_above, next_below = np.roll(above, -1), np.roll(below, -1)
    return np.stack([above, below, next_above, next_above, below, next_below], axis=-1).reshape(-1, 3)


def _bottom_faces(below: Index) -> Index:
    centre = np.full_like(below, below[-1] + 1)
    return np.stack([centre, np.roll(below, -1), below], axis=-1)
