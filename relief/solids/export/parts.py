"""Files of several bodies: 3MF, STL, OBJ, GLB and PLY, in mm unless the format defines another unit.

Written by numpy alone: a library of meshes takes half a second to import, longer than a run takes to write
all its files.
"""

import os
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np

from relief.ground.errors import InputError
from relief.ground.files import partial_file
from relief.ground.formats import FORMATS
from relief.ground.lengths import shown
from relief.solids.body import Body, Part


def writer_of(suffix: str) -> ModuleType:
    """The module that writes the format of a suffix, a key of `FORMATS`; see `PlateFormat.writer`."""
    return import_module(f"relief.solids.export.{FORMATS[suffix].writer}")


def as_written(body: Body, suffix: str) -> Body:
    """The body with the coordinates that a file holds, in double precision as readers give them.

    Args:
        body: Any body.
        suffix: A key of `FORMATS`. STL, PLY and GLB hold single precision, GLB in metres; 3MF and OBJ hold
            nine decimal digits.
    """
    return Body(writer_of(suffix).rounded(body.vertices), body.faces)


def write_parts(path: str | os.PathLike[str], parts: Sequence[Part]) -> Path:
    """Write parts as one file, whose suffix chooses the format; the same parts, the same bytes.

    3MF, OBJ and GLB keep the parts with their names apart; STL and PLY hold all their triangles. 3MF states
    mm, GLB is in metres with y up by its definition, the others have no unit and hold mm.

    Args:
        path: The file, which appears whole or not at all; missing folders are made.
        parts: One or more.

    Returns:
        The path.

    Raises:
        InputError: The suffix is none of `FORMATS`, there are no parts, or numbers are not finite.
        OSError: The file cannot be written.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in FORMATS:
        raise InputError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(FORMATS)}")
    if not parts:
        raise InputError(f"{path}: there is no body to write")
    for part in parts:
        numbers = [part.body.vertices] if part.placement is None else [part.body.vertices, part.placement]
        if not all(np.isfinite(each).all() for each in numbers):
            raise InputError(f"{path}: {shown(part.name)}: vertices or placement are not finite")
    with partial_file(path) as partial, partial.open("wb") as file:
        writer_of(suffix).write(parts, file)
    return path
