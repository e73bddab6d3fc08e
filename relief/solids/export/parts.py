"""Files of several bodies: 3MF, STL, OBJ, GLB and PLY, in mm unless the format defines another unit.

Written by numpy alone: a library of meshes takes half a second to import, longer than a run takes to write
all its files.
"""

import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from relief.ground.errors import InputError
from relief.ground.files import partial_file
from relief.ground.formats import FORMATS
from relief.ground.lengths import shown
from relief.solids.body import Body, Part, joined, ply_blocks, stl_blocks
from relief.solids.export.glb import MM_TO_METRES_Y_UP, glb
from relief.solids.export.threemf import lines, write_threemf


def obj(parts: Sequence[Part]) -> Iterator[bytes]:
    """Blocks of an OBJ file of parts, each an object of its name.

    A comment tells the unit, which the format lacks.
    """
    first = 1
    yield b"# Retouch, millimetres, z up\n"
    for part in parts:
        vertices, faces = part.placed
        # Programs end a name at the first space.
        yield f"o {shown(part.name).replace(' ', '_')}\n".encode()
        yield from lines("v %.9g %.9g %.9g\n", vertices)
        yield from lines("f %d %d %d\n", faces + first)
        first += len(vertices)


WRITERS: dict[str, Callable[[Sequence[Part], BinaryIO], None]] = {
    ".3mf": write_threemf,
    ".stl": lambda parts, file: file.writelines(stl_blocks(joined(parts))),
    ".obj": lambda parts, file: file.writelines(obj(parts)),
    ".glb": lambda parts, file: file.writelines(glb(parts)),
    ".ply": lambda parts, file: file.writelines(ply_blocks(joined(parts))),
}
"""The writer of each of `relief.ground.formats.FORMATS`, block by block."""


def as_written(body: Body, suffix: str) -> Body:
    """The body with the coordinates that a file holds, in double precision as readers give them.

    Args:
        body: Any body.
        suffix: One of `FORMATS`. STL, PLY and GLB hold single precision, GLB in metres; 3MF and OBJ hold nine
            decimal digits.
    """
    vertices = body.vertices
    if suffix in (".3mf", ".obj"):
        blocks = [np.fromstring(text.decode(), sep=" ") for text in lines("%.9g %.9g %.9g ", vertices)]
        return Body(np.concatenate(blocks).reshape(-1, 3), body.faces)
    if suffix == ".glb":
        metres = (vertices @ MM_TO_METRES_Y_UP).astype(np.float32).astype(np.float64)
        return Body(metres @ (1e6 * MM_TO_METRES_Y_UP.T), body.faces)
    return Body(vertices.astype(np.float32).astype(np.float64), body.faces)


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
        WRITERS[suffix](parts, file)
    return path
