"""The reader of each kind of file: by content where this states the kind, else by the name."""

import os
from collections.abc import Callable
from pathlib import Path

from relief.ground.errors import InputError
from relief.ground.formats import GRIDS, MEASURED
from relief.reading.arrays import read_npy
from relief.reading.exr import read_exr
from relief.reading.pictures import read_picture
from relief.reading.samples import Check, Samples, check_extent
from relief.reading.tiff import MAGIC, read_tiff

_MAGIC: dict[bytes, Callable[[Path, Check], Samples]] = {
    **dict.fromkeys(MAGIC, read_tiff),
    b"v/1\x01": read_exr,
    b"\x93NUM": read_npy,
    **dict.fromkeys((b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"RIFF"), read_picture),
}
"""Readers by the first bytes of a file."""
_SUFFIXES = {".tif": read_tiff, ".tiff": read_tiff, ".exr": read_exr, ".npy": read_npy}


def by_content(path: Path) -> Callable[[Path, Check], Samples] | None:
    """The reader of the kind that the first bytes of a file state; None if they state none."""
    with path.open("rb") as file:
        start = file.read(4)
    return next((read for mark, read in _MAGIC.items() if start.startswith(mark)), None)


def read_samples(path: str | os.PathLike[str], check: Check = check_extent) -> Samples:
    """Read what a file holds.

    Args:
        path: a picture (PNG, JPEG, TIFF, WebP, BMP, GIF, PGM, PPM), numbers (TIFF, EXR, NPY, text), or a
            measured surface of a profilometer or a microscope.
        check: refuses shapes before their samples are decoded.

    Raises:
        InputError: the file is missing, damaged, of no such kind, empty or too large.
    """
    path = Path(path)
    if not os.path.isfile(path):
        raise InputError(f"{path}: no such file")
    suffix = path.suffix.lower()
    known = by_content(path)
    reader = known or _SUFFIXES.get(suffix, read_picture)
    if (known is None and suffix in (*MEASURED, *GRIDS)) or reader is read_tiff:
        # Imported here: other files do without.
        from relief.reading.profilometers import read_measured

        if (surface := read_measured(path, check)) is not None:
            return surface
    if known is None and suffix in GRIDS:
        from relief.reading.text_grids import read_grid

        return read_grid(path, check)
    return reader(path, check)
