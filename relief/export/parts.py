"""Files of several bodies: 3MF, STL, OBJ, GLB and PLY, in mm unless the format defines another unit.

Written by numpy alone: a library of meshes takes half a second to import, longer than a run takes to write
all its files.
"""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from relief.body import Part, joined, ply, stl
from relief.common.errors import InputError
from relief.common.files import write_atomically
from relief.common.formats import FORMATS
from relief.common.lengths import shown
from relief.export.glb import glb
from relief.export.threemf import threemf


def obj(parts: Sequence[Part]) -> bytes:
    """Parts as an OBJ file, each an object of its name; a comment tells the unit, which the format lacks."""
    lines, first = ["# Retouch, millimetres, z up\n"], 1
    for part in parts:
        vertices, faces = part.placed
        # Programs end a name at the first space.
        lines.append(f"o {shown(part.name).replace(' ', '_')}\n")
        lines.append(("v %.9g %.9g %.9g\n" * len(vertices)) % tuple(vertices.ravel().tolist()))
        lines.append(("f %d %d %d\n" * len(faces)) % tuple((faces + first).ravel().tolist()))
        first += len(vertices)
    return "".join(lines).encode()


WRITERS: dict[str, Callable[[Sequence[Part]], bytes]] = {
    ".3mf": threemf,
    ".stl": lambda parts: stl(joined(parts)),
    ".obj": obj,
    ".glb": glb,
    ".ply": lambda parts: ply(joined(parts)),
}
"""The writer of each of `relief.common.formats.FORMATS`."""


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
    write_atomically(path, WRITERS[suffix](parts))
    return path
