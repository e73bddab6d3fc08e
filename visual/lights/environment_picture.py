"""Picture of an environment map, read from a file that may come from strangers."""

from __future__ import annotations

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from visual.backend.bitmap import SMALLEST_MAP, read_bitmap
from visual.backend.mitsuba import mi
from visual.lights.kind import Light


def environment_picture(light: Light) -> Array:
    """Picture of an environment map as Mitsuba reads it, times the light's `scale`.

    Args:
        light: of a checked scene.

    Returns:
        (rows, cols, 3) radiance.

    Raises:
        InputError: a file that is missing, damaged, no picture, too large or too small, or whose values are
            not finite; in one line.
    """
    if light.filename is None:
        raise InputError(f"{light.kind}: filename: missing")
    bitmap = read_bitmap(light.filename, f"{light.filename}: {light.kind}", SMALLEST_MAP).convert(
        mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False
    )
    return np.array(bitmap, dtype=np.float64) * light.scale
