"""Meshes in PLY files: checked before Mitsuba reads them, which follows any number of a vertex."""

import re
from pathlib import Path

import numpy as np

from relief.ground.errors import InputError
from visual.backend.messages import last_line

LARGEST_FILE = 256_000_000
"""Largest file of a mesh, bytes: five million vertices."""
LONGEST_HEADER = 65536
"""Longest header, bytes; common headers take a few hundred."""


def check_ply(path: Path) -> None:
    """Check that a mesh is whole.

    Raises:
        InputError: a file that is too large or damaged, vertices that are not finite, or faces of vertices
            that are not there; in one line.
    """
    # Imported here, because few scenes have meshes and trimesh takes half a second.
    import trimesh

    where, size = f"{path}: ply", path.stat().st_size
    if size > LARGEST_FILE:
        raise InputError(f"{where}: larger than {LARGEST_FILE} bytes; not read as a mesh")
    try:
        with path.open("rb") as file:
            head = file.read(LONGEST_HEADER)
            # An element takes at least one byte.
            if any(int(count[:20]) > size for count in re.findall(rb"element\s+\w+\s+(\d+)", head)):
                raise ValueError("shorter than its header says")
            file.seek(0)
            mesh = trimesh.load_mesh(file, file_type="ply", process=False)
        vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as error:  # trimesh raises of every kind.
        raise InputError(f"{where}: damaged: {last_line(error)}") from error
    if not np.isfinite(vertices).all():
        raise InputError(f"{where}: a vertex is not finite")
    if faces.size and not (faces.min() >= 0 and faces.max() < len(vertices)):
        raise InputError(f"{where}: a face has a vertex that is not there")
