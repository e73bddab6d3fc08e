"""Bitmaps: pictures that a scene names, read from files that may come from strangers."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
from PIL import Image, UnidentifiedImageError

from relief.ground.errors import InputError
from visual.backend.messages import last_line
from visual.backend.mitsuba import mi

SMALLEST_MAP = (3, 2)
"""Least rows and columns of an environment map: Mitsuba reads no smaller ones."""
LARGEST = (4096, 8192)
"""Most rows and columns of a picture; larger ones take gigabytes, to no effect."""
LONGEST_HEADER = 65536
"""Longest header of an HDR file, bytes; common headers take a few hundred."""


def read_bitmap(path: Path, where: str, smallest: tuple[int, int] = (1, 1)) -> Any:
    """Read a picture whole, after a look at its size.

    Args:
        path: EXR, HDR, PNG or JPEG.
        where: start of the error message.
        smallest: least rows and columns.

    Returns:
        The `mi.Bitmap`, all of whose values are finite.

    Raises:
        InputError: a file that is missing, damaged, no picture, too large or too small, or whose values are
            not finite; in one line.
    """
    rows, cols = _picture_size(path, where)
    if not (smallest[0] <= rows <= LARGEST[0] and smallest[1] <= cols <= LARGEST[1]):
        sizes = " to ".join(f"{size[1]} x {size[0]}" for size in (smallest, LARGEST))
        raise InputError(f"{where}: {cols} x {rows} pixels; {sizes} are read")
    try:
        bitmap = mi.Bitmap(str(path))
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{where}: damaged: {last_line(error)}") from error
    values = np.asarray(bitmap)
    finite = np.isfinite(values)
    if not finite.all():
        raise InputError(f"{where}: {np.count_nonzero(~finite)} values are not finite")
    return bitmap


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
                raise ValueError("no size in its header")
            return int(size[1]), int(size[2])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(path, formats=["PNG", "JPEG"]) as image:
                return image.height, image.width
    except UnidentifiedImageError as error:
        raise InputError(f"{where}: is neither an EXR, an HDR, a PNG nor a JPEG") from error
    except Image.DecompressionBombError as error:
        raise InputError(f"{where}: more pixels than are read") from error
    except (OSError, RuntimeError, ValueError, TypeError, KeyError, IndexError, SyntaxError) as error:
        raise InputError(f"{where}: damaged: {last_line(error)}") from error


def _exr_size(path: Path) -> tuple[int, int]:
    with OpenEXR.File(str(path), header_only=True) as file:
        low, high = file.parts[0].header["dataWindow"]
        return int(high[1]) - int(low[1]) + 1, int(high[0]) - int(low[0]) + 1
