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
from relief.reading.samples import SQUARE

LARGEST_FILE = 1 << 28
"""Most bytes of a file, and of the unpacked parts of a ZIP archive: 4096 x 4096 samples of 16 bytes."""
LEAST_MEMORY, MEMORY_BYTES = 3 << 29, 8
"""Most address space of the process, bytes: the imports and 4096 x 4096 samples in several copies, and more
for each byte of the file, as a text of 4096 x 4096 numbers takes 2.1 GB."""
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
        `kind`, `unit_mm` (None if unknown), `lengths`, `notes` and `shape` as of `Samples`; and the heights
        (rows, cols) in the file's unit, row 0 the top of the picture, NaN where nothing was measured.

    Raises:
        InputError: the file is damaged, holds no surface, or one that is too small or too large.
    """
    with damage_named(path, "a measured surface"):
        _check_bytes(path)
        reader = _reader(path)
        channel, note = _channel(reader, path)
        unit_mm, size_mm, shape = _extent(channel, sides_mm, path)
        cols, rows = channel.nb_grid_pts
        some_size = {} if channel.physical_sizes else {"physical_sizes": (float(cols), float(rows))}
        stored = np.ma.masked_invalid(channel.topography(**some_size).heights())
        heights = np.ma.filled(stored.astype(np.float64), np.nan).T
        if np.isnan(heights).all():
            raise InputError(f"{path}: nothing was measured")
        notes = [note]
        if not np.allclose(np.divide(shape, heights.shape), 1.0, rtol=SQUARE):
            heights = _resampled(heights, shape)
            notes.append(f"resampled from {cols} x {rows} samples, which are not square")
    lengths = {} if size_mm is None else {"size_mm": size_mm}
    header = {"kind": f"{reader.name()} of numbers", "unit_mm": unit_mm, "lengths": lengths}
    return header | {"notes": notes, "shape": heights.shape}, np.ascontiguousarray(heights)


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
    faults: list[Exception] = []
    for one in sorted(asked, key=lambda each: suffix not in each.file_extensions()):
        try:
            # The library reads UTF-8 alone; programs of Windows write one byte a character.
            return one(StringIO(_decoded(content)) if one.format() == "asc" else str(path))
        except Exception as error:
            faults.append(error)
    raise faults[0] if faults else InputError(f"{path}: damaged, or of no kind that SurfaceTopography knows")


def _decoded(content: bytes) -> str:
    with suppress(UnicodeDecodeError):
        return content.decode("utf-8-sig")
    return content.decode("latin-1")


def _channel(reader: Any, path: Path) -> tuple[Any, str]:
    """The channel of heights that is read, the reader's own choice if that has heights, and its name."""
    channels = reader.channels
    names = ", ".join(shown(one.name) for one in channels)
    surfaces = [one for one in (reader.default_channel, *channels) if one.is_height_channel and one.dim == 2]
    if not surfaces or reader.format() == "xyz":
        what = "a profile along a line" if any(one.dim == 1 for one in channels) else names
        raise InputError(f"{path}: holds {what}; a height map is a surface")
    return surfaces[0], f"channel {shown(surfaces[0].name)}" + f" of {names}" * (len(channels) > 1)


def _extent(
    channel: Any, sides_mm: tuple[float, float], path: Path
) -> tuple[float | None, float | None, tuple[int, int]]:
    """Mm of a height of 1, width in mm, and (rows, cols) of square samples, before heights are read."""
    from SurfaceTopography.Support import UnitConversion as units

    unit = units.mangle_length_unit_utf8(channel.unit) if channel.unit else None
    unit_mm = float(units.get_unit_conversion_factor(unit, "mm")) if units.is_length_unit(unit) else None
    counts = np.array(channel.nb_grid_pts)
    sides = np.abs(np.asarray(channel.physical_sizes or counts, dtype=np.float64))
    pitches = sides / counts
    if not (np.isfinite(pitches).all() and pitches.min() > 0.0):
        raise InputError(f"{path}: its size is {shown(channel.physical_sizes)}")
    cols, rows = map(int, np.rint(sides / pitches.min()))
    if max(cols, rows) > LARGEST_SIDE:
        raise InputError(f"{path}: {cols} x {rows} square samples; at most {LARGEST_SIDE} a side are read")
    if channel.physical_sizes is None or unit_mm is None:
        return unit_mm, None, (rows, cols)
    width, height = sides * unit_mm
    least, most = sides_mm
    size = f"{width:.3g} x {height:.3g} mm"
    if min(width, height) < least:
        raise InputError(f"{path}: {size}; at least {least:g} mm are needed under a finger")
    if max(width, height) > most:
        raise InputError(f"{path}: {size}; at most {most:g} mm a side are read")
    return unit_mm, float(width), (rows, cols)


def _resampled(heights: Array, shape: tuple[int, int]) -> Array:
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
        memory = LEAST_MEMORY + MEMORY_BYTES * os.path.getsize(path)
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
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
