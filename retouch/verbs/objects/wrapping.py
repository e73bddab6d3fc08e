"""Wrapping: a tile on an object, with the same size in mm everywhere; and a page that shows it in seconds.

The page shows the object and its texture on few triangles.
"""

import logging
import os
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np

from relief.ground.errors import InputError, naming
from relief.ground.files import check_file_to_write, permitted
from relief.ground.formats import FORMATS
from relief.ground.formatting import about
from relief.ground.options import by_keywords
from relief.ground.progress import listening, stage
from relief.relief import Relief
from relief.solids.body import Part
from relief.solids.export.parts import as_written, write_parts
from relief.solids.export.printed_parts import PrintedPart, print_part
from relief.solids.export.project_writer import Textured, check_project, write_project
from relief.solids.meshes.solid import check_closed, check_parts
from relief.solids.wrapping.edges import BYTES_A_FACE, expected_file
from relief.solids.wrapping.wrapped_body import Wrapped
from retouch.pages.objects.wrap_sentences import wrapped_sentences
from retouch.pages.sentences import print_deviation
from retouch.verbs.objects.steering import Steered, with_steered, without_steered
from retouch.verbs.objects.wrap_options import WrapOptions
from retouch.verbs.objects.wrap_task import Task, size_words, task_of, wrap_numbers
from retouch.verbs.progress_display import followed
from retouch.verbs.reliefs import Source

if TYPE_CHECKING:
    from retouch.pages.objects.wrap_page import Preview

MANY = 1.2
"""Number of triangles, in that asked for, from which it is told why there are more."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class WrappedObject:
    """An object with a texture, and its file.

    Attributes:
        file: that was written.
        wrapped: the body, and how the texture lies on it.
        warnings: lines about what may not be meant, and what was mended.
        printed: what the printer makes of it that is named; None without one.
        steered: tiles that were optimised for its regions.
        most_faces: number of triangles that was asked for; None: none was.
    """

    file: Path
    wrapped: Wrapped
    warnings: tuple[str, ...]
    printed: PrintedPart | None = None
    steered: tuple[Steered, ...] = ()
    most_faces: int | None = None

    def as_json(self) -> dict[str, Any]:
        """What `retouch wrap --json` prints."""
        names = ("area_mm2", "edge_mm", "coordinates", "patches", "blended", "off_size", "stretch", "notes")
        return {
            "file": str(self.file),
            "size_mm": np.ptp(self.wrapped.body.vertices, axis=0).tolist(),
            "faces": len(self.wrapped.body.faces),
            "self_intersections": 0,
            **{name: getattr(self.wrapped, name) for name in names},
            **wrap_numbers(self.wrapped),
            "steered": [one.as_json() for one in self.steered],
            "print": self.printed and self.printed.as_json(),
            "warnings": list(self.warnings),
            "bytes": self.file.stat().st_size,
        }

    def lines(self) -> list[str]:
        """Size, triangles and how the texture lies, for a person."""
        wrapped, size = self.wrapped, size_words(self.wrapped.body)
        mebibytes = self.file.stat().st_size / 2**20
        lines = [
            f"{self.file}: {size} mm, {len(wrapped.body.faces):,} triangles, closed, {mebibytes:.1f} MiB",
            f"Texture on {wrapped.area_mm2:.0f} mm², the whole relief on "
            f"{wrapped.presence.whole_mm2:.0f} mm² of it, with edges of {wrapped.edge_mm:.2g} mm, by "
            f"{_coordinates(wrapped)}; seams are blended on {100 * wrapped.blended:.0f} % of it.",
            *wrapped_sentences(wrapped),
        ]
        if self.most_faces and len(wrapped.body.faces) > MANY * self.most_faces:
            lines.append(
                f"These are more triangles than the {self.most_faces:,} of --faces: "
                f"{len(wrapped.base.rest.faces):,} carry no texture, and the others are no larger than the "
                "surface needs."
            )
        lines += [one.line() for one in self.steered]
        if bends := _bending_line(wrapped):
            lines.append(bends)
        if self.printed is not None:
            deviation = print_deviation(self.printed.rms_mm, self.printed.lost)
            lines.append(f"As printed by {self.printed.printer.name}: {deviation}")
        return lines


@by_keywords(WrapOptions)
def wrap(
    texture: Source, mesh: str | os.PathLike[str], out: str | os.PathLike[str], options: WrapOptions
) -> WrappedObject:
    """Displace the surface of a solid by a texture, and write the solid that comes out.

    Args:
        texture: a tile, or a texture to place once: a `Relief`, heights (rows, cols) in mm, a height map, the
            name of a bundled one, or the folder of a run.
        mesh: file of a solid (STL, OBJ, PLY, GLB, 3MF, STEP), or the name of a bundled object.
        out: file to write: .3mf, .stl, .obj, .glb or .ply.

    Raises:
        InputError: the mesh is no solid, a mask cannot be read, an option is out of range or does not go with
            the others, or the file cannot be written.
    """
    out = Path(out)
    if out.suffix.lower() not in FORMATS:
        fault = f"suffix {out.suffix!r} is not one of {', '.join(FORMATS)}"
        raise InputError(f"{out}: {fault}", f"{out}: -o: {fault}")
    check_file_to_write(out)
    if _in_project(Path(mesh), out, options.units):
        check_project(Path(mesh))
    with followed(options.progress, options.quiet):
        options, steered = with_steered(texture, mesh, out, options)
        task = task_of(texture, mesh, options)
        with naming(mesh):
            written = partial(as_written, suffix=out.suffix.lower())
            wrapped = task.wrapped(task.settings, written)
            check_closed(wrapped.body, "the wrapped object")
            check_parts(wrapped.body, "the wrapped object")
            printed = None if task.printer is None else print_part(wrapped.body, task.printer)
        with permitted(out):
            lines = _write(out, task, wrapped, options.units)
        for line in lines:
            _log.warning("%s: %s", out, line)
    return WrappedObject(out, wrapped, (*task.warnings, *lines), printed, tuple(steered), options.faces)


def _write(out: Path, task: Task, wrapped: Wrapped, units: str | None) -> list[str]:
    """Write a 3MF with all else that the 3MF of the mesh holds, or the parts; lines about what is lost.

    A project has its own unit, so that a mesh in other `units` is written as parts.
    """
    mesh, lines = task.mesh, list[str]()
    parts = [Part(mesh.path.stem, wrapped.body)]
    if mesh.pieces:
        source = mesh.origin[wrapped.source]
        whole = Textured(mesh.pieces, mesh.unit_mm, wrapped.body, source, wrapped.fine)
        if _in_project(mesh.path, out, units):
            return write_project(out, mesh.path, whole)
        if _in_project(mesh.path, out, None):
            lines.append("leaves out all but the parts of the project, whose own unit --units overrides")
        parts = whole.parts()
    write_parts(out, parts)
    return lines


def _in_project(mesh: Path, out: Path, units: str | None) -> bool:
    """Whether a mesh comes out in the project that holds it."""
    return mesh.suffix.lower() == out.suffix.lower() == ".3mf" and units is None


def _coordinates(wrapped: Wrapped) -> str:
    """What flattens the surface, in words."""
    kind, count = wrapped.coordinates, wrapped.patches
    if kind == "patches":
        return "one patch" if count == 1 else f"{count} patches"
    return str(kind) if kind == "texture coordinates" else f"a {kind}"


def _bending_line(wrapped: Wrapped) -> str | None:
    """Radii of the object along the texture, as options by which a tile is optimised for them."""
    radii = {axis: one.radius_mm for axis, one in zip("xy", wrapped.bending, strict=True)}
    flags = [f"--curved-{axis}-mm {radius:.3g}" for axis, radius in radii.items() if radius is not None]
    if not flags:
        return None
    return f"In the median the object bends as a tile is steered for by retouch optimize {' '.join(flags)}."


SHOWN_FACES = 180_000
"""Triangles that are shown, about."""
SECONDS_PER_FACE = 1.6e-5
"""Time of `wrap` for each triangle, s, on the processor on which previews wrap a frog in 5 s."""
LONGER = 3.0
"""Time of `wrap` without that of its fine triangles, in that of the preview. With both numbers the time of
five objects comes out within a fifth, and that of a knob half too long (`benchmarks.objects.previews`)."""


@dataclass(frozen=True, eq=False)
class WrapPreview:
    """A page about what `wrap` will make.

    Attributes:
        file: the page.
        preview: its content.
        warnings: lines about tiles that are larger than the object.
    """

    file: Path
    preview: "Preview"
    warnings: tuple[str, ...]

    def as_json(self) -> dict[str, Any]:
        """What `retouch wrap --preview --json` prints; what is expected of the whole wrapping is rounded."""
        shown = self.preview.shown
        return {
            "preview": str(self.file),
            "size_mm": np.ptp(shown.body.vertices, axis=0).tolist(),
            "faces": self.preview.faces,
            "bytes": self.preview.bytes,
            "seconds": self.preview.seconds,
            "shown_faces": len(shown.body.faces),
            "area_mm2": shown.area_mm2,
            "edge_mm": self.preview.edge_mm,
            "shown_edge_mm": shown.edge_mm,
            "coordinates": shown.coordinates,
            **wrap_numbers(shown),
            "print": self.preview.printed and self.preview.printed.as_json(),
            "off_size": shown.off_size,
            "notes": list(shown.notes),
            "warnings": list(self.warnings),
        }

    def line(self) -> str:
        """What the file will come to, for a person."""
        preview, body = self.preview, self.preview.shown.body
        time, unit = about(preview.seconds)
        return (
            f"{self.file}: {size_words(body)} mm on {len(body.faces):,} triangles; retouch wrap will make "
            f"about {round(preview.faces, -4):,}, {preview.bytes / 2**20:.2g} MiB as 3MF, in about {time} "
            f"{unit}."
        )


@by_keywords(WrapOptions)
def preview_wrap(
    texture: Source, mesh: str | os.PathLike[str], page: str | os.PathLike[str], options: WrapOptions
) -> WrapPreview:
    """Write a page that shows the object with its texture on few triangles, and what the file will come to.

    Args: as of `wrap`, but for one.
        page: HTML file to write.

    Raises:
        InputError: as of `wrap`; or the page cannot be written.
    """
    page = Path(page)
    _check_page(page)
    with followed(options.progress, options.quiet), stage("preview"):
        task = task_of(texture, mesh, without_steered(options))
        with naming(mesh):
            preview = _preview(f"{_name(texture)} on {Path(mesh).stem}", task)
        with permitted(page):
            # Imported here: a wrapping has no page.
            from retouch.pages.objects.wrap_page import write_wrap_page

            write_wrap_page(page, preview)
    return WrapPreview(page, preview, task.warnings)


def _check_page(page: Path) -> None:
    """Refuse what is no place for a page. Raises InputError."""
    fault = None
    if page.suffix.lower() not in (".html", ".htm"):
        fault = f"suffix {page.suffix!r} is not .html"
    elif not page.parent.is_dir():
        fault = f"there is no folder {page.parent}"
    elif page.is_dir():
        fault = "is a folder"
    if fault:
        raise InputError(f"{page}: {fault}", f"{page}: --preview: {fault}")


def _preview(title: str, task: Task) -> "Preview":
    """The content of the page, by wrapping with few triangles, from which the file is estimated."""
    from retouch.pages.objects.wrap_page import Preview

    begun = perf_counter()
    few = replace(task.settings, faces=SHOWN_FACES, edge_mm=None, draft=True)
    # Nobody is to hear of the triangles of the preview as if they were those of the file.
    with listening(None):
        shown = task.wrapped(few)
    edge_mm, faces = expected_file(shown.base, task.coverings, task.settings)
    seconds = LONGER * (perf_counter() - begun) + SECONDS_PER_FACE * faces
    size = round(BYTES_A_FACE * faces)
    printed = None
    if task.printer is not None:
        # On the triangles that are shown, as a page of more would be too large.
        printed = print_part(shown.body, task.printer, 2.0 * shown.edge_mm)
    return Preview(title, shown, edge_mm, faces, size, seconds, printed)


def _name(texture: Source) -> str:
    """A texture's name in a heading."""
    if isinstance(texture, Relief):
        return Path(texture.name).stem
    return Path(texture).stem if isinstance(texture, str | os.PathLike) else "heights"
