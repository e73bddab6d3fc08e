"""Picture of an environment map, read from a file that may come from strangers."""

import re
import warnings
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from relief.arrays import Array
from relief.errors import InputError
from visual.backend.messages import last_line
from visual.lights.kind import Light

SMALLEST, LARGEST = (3, 2), (4096, 8192)
"""Rows and columns of pictures: Mitsuba reads no smaller ones; larger ones take gigabytes, to no effect."""
LONGEST_HEADER = 65536
"""Longest header of an HDR file, bytes; common headers take a few hundred."""


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
    import mitsuba as mi

    if light.filename is None:
        raise InputError(f"{light.kind}: filename: missing")
    where = f"{light.filename}: {light.kind}"
    rows, cols = _picture_size(light.filename, where)
    if not (SMALLEST[0] <= rows <= LARGEST[0] and SMALLEST[1] <= cols <= LARGEST[1]):
        sizes = " to ".join(f"{size[1]} x {size[0]}" for size in (SMALLEST, LARGEST))
        raise InputError(f"{where}: {cols} x {rows} pixels; {sizes} are read")
    try:
        bitmap = mi.Bitmap(str(light.filename)).convert(
            mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False
        )
    except RuntimeError as error:
        raise InputError(f"{where}: damaged: {last_line(error)}") from error
    radiance = np.array(bitmap, dtype=np.float64) * light.scale
    if not np.isfinite(radiance).all():
        raise InputError(f"{where}: {np.count_nonzero(~np.isfinite(radiance))} values are not finite")
    return radiance


def _picture_size(path: Path, where: str) -> tuple[int, int]:
    """(rows, cols) by a picture's header alone: a file may claim more pixels than memory holds."""
    try:
        with path.open("rb") as file:
            head = file.read(LONGEST_HEADER)
        if head.startswith(b"\x76\x2f\x31\x01"):
            return _exr_size(path)
        if head.startswith(b"#?"):
            size = re.search(rb"\n-Y +(\d{1,9}) +\+X +(\d{1,9})\n", head)
            if size is None:
                raise InputError(f"{where}: damaged: no size in its header")
            return int(size[1]), int(size[2])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path, formats=["PNG", "JPEG"]) as image:
                return image.height, image.width
    except UnidentifiedImageError as error:
        raise InputError(f"{where}: is neither an EXR, an HDR, a PNG nor a JPEG") from error
    except Image.DecompressionBombError as error:
        raise InputError(f"{where}: more pixels than are read") from error
    except InputError:
        raise
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, IndexError, SyntaxError) as error:
        raise InputError(f"{where}: damaged: {last_line(error)}") from error


def _exr_size(path: Path) -> tuple[int, int]:
    import OpenEXR

    with OpenEXR.File(str(path), header_only=True) as file:
        low, high = file.parts[0].header["dataWindow"]
        return int(high[1]) - int(low[1]) + 1, int(high[0]) - int(low[0]) + 1
