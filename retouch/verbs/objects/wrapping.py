"""Wrapping: a tile on an object, with the same size in mm everywhere."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Unpack

import numpy as np

from relief.ground.errors import InputError, naming
from relief.ground.files import check_file_to_write, permitted
from relief.ground.formats import FORMATS
from relief.ground.progress import Progress
from relief.solids.body import Part
from relief.solids.export.parts import as_written, write_parts
from relief.solids.export.printed_parts import PrintedPart, print_part
from relief.solids.meshes import check_solid
from relief.solids.meshes.solid import check_closed
from relief.solids.wrapping.wrapped_body import Wrapped
from relief.solids.wrapping.wrapped_body import wrap as wrapped_by
from retouch.verbs.objects.steering import Steered, with_steered, without_steered
from retouch.verbs.objects.wrap_task import WrapOptions, task_of, told_of
from retouch.verbs.progress_display import followed
from retouch.verbs.reliefs import Source


@dataclass(frozen=True, eq=False)
class WrappedObject:
    """An object with a texture, and its file.

    Attributes:
        file: that was written.
        wrapped: the body, and how the texture lies on it.
        warnings: lines about what may not be meant, and what was mended.
        printed: what the printer makes of it that is named; None without one.
        steered: tiles that were optimised for its regions.
    """

    file: Path
    wrapped: Wrapped
    warnings: tuple[str, ...]
    printed: PrintedPart | None = None
    steered: tuple[Steered, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """What `retouch wrap --json` prints."""
        names = ("area_mm2", "edge_mm", "coordinates", "patches", "blended", "off_size", "stretch", "notes")
        return {
            "file": str(self.file),
            "size_mm": np.ptp(self.wrapped.body.vertices, axis=0).tolist(),
            "faces": len(self.wrapped.body.faces),
            "self_intersections": 0,
            **{name: getattr(self.wrapped, name) for name in names},
            **told_of(self.wrapped),
            "steered": [one.as_json() for one in self.steered],
            "print": self.printed and self.printed.as_json(),
            "warnings": list(self.warnings),
            "bytes": self.file.stat().st_size,
        }


def wrap(
    texture: Source,
    mesh: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
    **options: Unpack[WrapOptions],
) -> WrappedObject:
    """Displace the surface of a solid by a texture, and write the solid that comes out.

    Args:
        texture: a tile, or a texture to place once: a `Relief`, heights (rows, cols) in mm, a height map, the
            name of a bundled one, or the folder of a run.
        mesh: file of a solid (STL, OBJ, PLY, GLB, 3MF), or the name of an object that comes with Retouch.
        out: file to write: .3mf, .stl, .obj, .glb or .ply.
        options: keywords that state what is done, listed with `retouch.verbs.objects.wrap_task.WrapOptions`.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: the mesh is no solid, a mask cannot be read, an option is out of range or does not go with
            the others, or the file cannot be written.
    """
    out = Path(out)
    if out.suffix.lower() not in FORMATS:
        fault = f"suffix {out.suffix!r} is not one of {', '.join(FORMATS)}"
        raise InputError(f"{out}: {fault}", f"{out}: -o: {fault}")
    check_file_to_write(out)
    with followed(progress, quiet):
        task_of(texture, mesh, without_steered(options))
        options, steered = with_steered(texture, mesh, out, options)
        task = task_of(texture, mesh, options)
        with naming(mesh):
            written = partial(as_written, suffix=out.suffix.lower())
            wrapped = wrapped_by(*task.arguments, written, task.placement, task.colours)
            if task.settings.crosses:
                check_closed(wrapped.body, "the wrapped object")
            else:
                check_solid(wrapped.body, "the wrapped object", apart=True)
            printed = None if task.printer is None else print_part(wrapped.body, task.printer)
        with permitted(out):
            write_parts(out, [Part(Path(mesh).stem, wrapped.body)])
    return WrappedObject(out, wrapped, task.warnings, printed, tuple(steered))
