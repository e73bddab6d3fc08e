"""Child process that reads a measured surface by SurfaceTopography.

A hostile file can crash its C libraries, never end, or ask for any memory, so the process is limited. It runs
as `python -m relief.reading.surface_topography FILE` and writes a line of JSON to stdout, and after the line
the heights: (rows, cols) numbers of 8 bytes. Of a file that is refused the JSON has `error` alone.
"""

import json
import os
import sys
import zipfile
from contextlib import suppress
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from scipy import ndimage

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.files import damage_named, read_limited
from relief.ground.formats import GRIDS
from relief.ground.lengths import shown
from relief.ground.limits import LARGEST_SIDE
from relief.reading.samples import SQUARE, check_extent

LARGEST_FILE = 1 << 28
"""Most bytes of a file, and of the unpacked parts of a ZIP archive: 4096 x 4096 samples of 16 bytes."""
MOST_MEMORY = 3 << 30
"""Most address space of the process, bytes; a text of 4096 x 4096 numbers takes two thirds."""
MOST_SECONDS = 180
"""Most CPU seconds of the process; a text of 4096 x 4096 numbers takes a tenth."""
NARROWEST_MM, WIDEST_MM = 1.0, 100.0
"""Least and greatest side of a surface, mm: less than a millimetre lies under one receptor of the finger."""
READERS = (
    *("al3d", "asc", "bcr", "datx", "di", "ezd", "frt", "gwy", "ibw", "jpk", "lext", "mdt", "metropro", "mi"),
    *("mnt", "oir", "opd", "opdx", "os3d", "plu", "plux", "poir", "ps", "sdf", "sur", "tmd", "vk", "wsxm"),
    *("x3p", "xyz", "zmg", "zon"),
)
"""The library's readers that are asked. The others read files of no unit (MAT, HDF5, NPY, NPZ, HGT), archives
of any content, profiles alone, or sizes of NMS a million times too large (version 1.27.1)."""


TEXTS = ("asc", "xyz")
"""Those of them that read any text."""


def read_surface(
    path: Path, sides_mm: tuple[float, float] = (NARROWEST_MM, WIDEST_MM)
) -> tuple[dict[str, Any], Array]:
    """Read the heights of a file.

    Each reader of the library gives heights (x, y), y downward as in the instrument's own picture.

    Args:
        path: the file.
        sides_mm: least and greatest side of a surface that is read, mm.

    Returns:
        `kind`, `unit_mm` and `size_mm` (None if the file does not say), `notes` and `shape`; and the heights
        (rows, cols) in the file's unit, row 0 the top of the picture, NaN where nothing was measured.

    Raises:
        InputError: the file is damaged, holds no surface, or one that is too small or too large.
    """
    with damage_named(path, "a measured surface"):
        _check_bytes(path)
        # Imported here: what the import prints stays inside.
        from SurfaceTopography.Support.UnitConversion import (
            get_unit_conversion_factor,
            is_length_unit,
            mangle_length_unit_utf8,
        )

        reader = _reader(path)
        channel, names = _channel(reader, path)
        unit = mangle_length_unit_utf8(channel.unit) if channel.unit else None
        unit_mm = float(get_unit_conversion_factor(unit, "mm")) if is_length_unit(unit) else None
        cols, rows = channel.nb_grid_pts
        check_extent((rows, cols), path)
        sides = channel.physical_sizes
        pitches = np.abs([1.0, 1.0] if sides is None else np.asarray(sides, float) / (cols, rows))
        if not (np.isfinite(pitches).all() and pitches.min() > 0.0):
            raise InputError(f"{path}: its size is {shown(sides)}")
        new_cols, new_rows = np.rint(pitches / pitches.min() * (cols, rows))
        if max(new_cols, new_rows) > LARGEST_SIDE:
            square = " square" * ((new_cols, new_rows) != (cols, rows))
            samples = f"{new_cols:.0f} x {new_rows:.0f}{square} samples"
            raise InputError(f"{path}: {samples}; at most {LARGEST_SIDE} a side are read")
        size_mm = None if sides is None or unit_mm is None else pitches * (cols, rows) * unit_mm
        if size_mm is not None:
            _check_size(size_mm, sides_mm, path)
        missing_size = {} if sides is not None else {"physical_sizes": (float(cols), float(rows))}
        stored = channel.topography(**missing_size).heights()
        heights = np.ma.filled(np.ma.masked_array(stored, dtype=np.float64), np.nan).T
        if heights.shape != (rows, cols):
            raise InputError(f"{path}: {heights.shape} heights; its header says {(rows, cols)}")
        heights = np.where(np.isfinite(heights), heights, np.nan)
        if np.isnan(heights).all():
            raise InputError(f"{path}: nothing was measured")
        notes = names
        if abs(pitches[0] / pitches[1] - 1.0) > SQUARE:
            heights = _square(heights, (int(new_rows), int(new_cols)))
            notes += [f"resampled from {cols} x {rows} samples, which are not square"]
        return {
            "kind": f"{reader.name()} of numbers",
            "unit_mm": unit_mm,
            "size_mm": None if size_mm is None else float(size_mm[0]),
            "notes": notes,
            "shape": heights.shape,
        }, np.ascontiguousarray(heights)


def _check_bytes(path: Path) -> None:
    """Raise InputError for a file, or an archive's parts, of more bytes than a surface has."""
    size = path.stat().st_size
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            size = max(size, sum(part.file_size for part in archive.infolist()))
    if size > LARGEST_FILE:
        raise InputError(f"{path}: holds {size} bytes; at most {LARGEST_FILE} are read")


def _reader(path: Path) -> Any:
    """The reader that takes the file: of those that know its first bytes, or else of those that may."""
    from SurfaceTopography.IO import MagicMatch, readers

    suffix, content = path.suffix.lower()[1:], read_limited(path, LARGEST_FILE)
    text = b"\0" not in content and f".{suffix}" in (*GRIDS, ".hfm")
    asked = [one for one in readers if one.format() in READERS and (text or one.format() not in TEXTS)]
    marks = {one: one.can_read(content[:512]) for one in asked}
    best = MagicMatch.YES if MagicMatch.YES in marks.values() else MagicMatch.MAYBE
    asked = [one for one in asked if marks[one] == best]
    fault: Exception | None = None
    for one in sorted(asked, key=lambda each: suffix not in each.file_extensions()):
        try:
            # The library reads UTF-8 alone; programs of Windows write one byte a character.
            return one(StringIO(_decoded(content)) if one.format() == "asc" else str(path))
        except Exception as error:
            fault = fault or error
    raise fault or InputError(f"{path}: damaged, or of no kind that SurfaceTopography knows")


def _decoded(content: bytes) -> str:
    with suppress(UnicodeDecodeError):
        return content.decode()
    return content.decode("latin-1")


def _channel(reader: Any, path: Path) -> tuple[Any, list[str]]:
    """The channel of heights that is read, and a note of its name, if it has one or there are several."""
    channels = reader.channels
    surfaces = [one for one in (reader.default_channel, *channels) if one.is_height_channel and one.dim == 2]
    if not surfaces or reader.format() == "xyz":
        profile = any(one.dim == 1 for one in channels)
        what = "a profile along a line" if profile else ", ".join(shown(one.name) for one in channels)
        raise InputError(f"{path}: holds {what or 'nothing'}; a height map is a surface")
    name, others = surfaces[0].name, len(channels) - 1
    if not others and name.lower() in ("default", "channel 0"):
        return surfaces[0], []
    of_all = f" of {', '.join(shown(one.name) for one in channels)}" if others else ""
    return surfaces[0], [f"channel {shown(name)}{of_all}"]


def _check_size(size_mm: Array, sides_mm: tuple[float, float], path: Path) -> None:
    """Raise InputError for sides that are too short to feel, or too long to read."""
    (least, most), size = sides_mm, f"{size_mm[0]:.3g} x {size_mm[1]:.3g} mm"
    if size_mm.min() < least:
        raise InputError(f"{path}: {size}; at least {least:g} mm are needed under a finger")
    if size_mm.max() > most:
        raise InputError(f"{path}: {size}; at most {most:g} mm a side are read")


def _square(heights: Array, shape: tuple[int, int]) -> Array:
    """Heights on more rows or columns by cubic splines; a sample is missing where the nearest one is.

    No height is lower or higher than all heights before: splines overshoot at walls.
    """
    factors = tuple(np.divide(shape, heights.shape))
    holes = ~np.isfinite(heights)
    nearest = ndimage.distance_transform_edt(holes, return_distances=False, return_indices=True)
    options = {"mode": "nearest", "grid_mode": True}
    resampled = ndimage.zoom(heights[tuple(nearest)], factors, order=3, **options)
    resampled[ndimage.zoom(holes.astype(np.uint8), factors, order=0, **options) > 0] = np.nan
    return np.clip(resampled, np.nanmin(heights), np.nanmax(heights))


def main(path: str) -> None:
    """Read a file within the limits of memory and time, and write it to stdout."""
    with suppress(ImportError, ValueError, OSError):  # Windows has no limits; others may have lower ones.
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    # Whatever prints, in Python or C, prints to stderr.
    stdout = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    heights = np.empty(0)
    try:
        header, heights = read_surface(Path(path))
    except InputError as error:
        header = {"error": str(error)}
    with stdout:
        stdout.write(json.dumps(header).encode() + b"\n" + heights.tobytes())


if __name__ == "__main__":
    main(sys.argv[1])
