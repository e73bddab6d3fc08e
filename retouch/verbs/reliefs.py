"""Reliefs and solids as the verbs take them: values, arrays, or files."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Unpack

from numpy.typing import ArrayLike

from mitsuba_scenes import find_texture
from relief.common.errors import InputError
from relief.common.lengths import Lengths
from relief.common.limits import PATCH_SIDE_MM
from relief.common.progress import say
from relief.meshes import Mesh, check_solid, read_mesh
from relief.objects.table import OBJECTS
from relief.printers import Printer, find_printer
from relief.relief import Relief
from relief.surface import Repeats

Source = Relief | ArrayLike | str | os.PathLike[str]
"""A relief, heights (rows, cols) in mm, a height map, the name of a bundled one, or a run directory."""


def relief_of(
    source: Source,
    *,
    repeats: Repeats = False,
    printer: str | Printer | None = None,
    **lengths: Unpack[Lengths],
) -> Relief:
    """The relief that an argument of a verb stands for; arguments as in `Relief.read`.

    Raises:
        InputError: as of `Relief.read`; or an argument that a value has already.
    """
    made_by = find_printer(printer) if isinstance(printer, str) else printer
    if isinstance(source, str | os.PathLike):
        return Relief.read(find_texture(source), repeats=repeats, printer=made_by, **lengths)
    if not isinstance(source, Relief):
        size_mm = lengths.pop("size_mm", None)
        source = Relief.of(source, PATCH_SIDE_MM if size_mm is None else size_mm, repeats)
    refuse("files", lengths)
    return source if made_by is None else source.printed(made_by)


def refuse(kind: str, values: Mapping[str, object]) -> None:
    """Raise InputError for an argument that is there, but belongs to another kind of input."""
    for name, value in values.items():
        if value is not None:
            raise InputError(f"{name}: is for {kind}")


def read_solid(path: str | os.PathLike[str], *, units: str | None = None) -> Mesh:
    """Read a print file, which must be a solid, or make an object that comes with Retouch.

    Args:
        path: STL, OBJ, PLY, GLB or 3MF, or the name of a bundled object.
        units: of the file, where it does not state its own or a wrong one: "um", "mm", "cm", "m", "in" or
            "ft".

    Raises:
        InputError: the file cannot be read, or its mesh is no solid.
    """
    path = Path(path)
    if (thing := OBJECTS.get(str(path))) is not None:
        return Mesh(thing.make(), None, path)
    mesh = read_mesh(path, units=units)
    for line in mesh.warnings:
        say(f"{path}: {line}")
    check_solid(mesh.body, path)
    return mesh
