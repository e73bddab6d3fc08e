"""Maps over a surface: a picture or an array with a value for each point, such as a mask or a target."""

import os
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.heightmap import load_content
from relief.places import cut, patch_shape
from relief.surface import Surface


def load_map(path: str | os.PathLike[str], surface: Surface) -> tuple[Array, bool]:
    """Read a map that lies over a whole surface, row 0 at +y.

    Args:
        path: PNG, TIFF, EXR or NPY with one channel; of any size, with the proportions of the surface.
        surface: on which the map lies.

    Returns:
        (rows, cols) at the samples of the surface, each the nearest value of the map; and whether the values
        are grey of a picture, within 0 and 1, rather than numbers as they stand in the file.

    Raises:
        InputError: the file is missing or damaged, its proportions are not those of the surface with the
            shorter side rounded to whole samples, or a value is not finite.
    """
    path = Path(path)
    content = load_content(path)
    values = content.values
    (rows, cols), shape = values.shape, surface.shape
    if abs(rows * shape[1] - cols * shape[0]) > 0.5 * max(shape):
        size = f"{surface.width_mm:g} x {surface.height_mm:g} mm in {shape[1]} x {shape[0]} samples"
        fault = f"{cols} x {rows} samples have not the proportions of the surface"
        raise InputError(f"{path}: {fault}, {size}")
    if not np.isfinite(values).all():
        raise InputError(f"{path}: {np.count_nonzero(~np.isfinite(values))} values are not finite")
    sizes = zip(shape, values.shape, strict=True)
    nearest = (((np.arange(n) + 0.5) * (stored / n)).astype(int) for n, stored in sizes)
    return values[np.ix_(*nearest)], not content.holds_numbers


def means_under(values: Array, surface: Surface, places: Index) -> Array:
    """(k,) means over the finger's patch at each place.

    Args:
        values: (rows, cols) at the samples of the surface.
        surface: on which the values lie.
        places: (k, 2) as of `relief.places`.
    """
    shape = patch_shape(surface)
    return np.array([cut(values, place[None], shape).mean() for place in places])
