"""A page that shows in seconds what `retouch wrap` will make: the object and its texture on few triangles."""

import os
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from relief.ground.errors import InputError, naming
from relief.ground.files import permitted
from relief.ground.formatting import about
from relief.ground.options import by_keywords
from relief.ground.progress import listening, stage
from relief.relief import Relief
from relief.solids.export.printed_parts import print_part
from relief.solids.wrapping.edges import BYTES_A_FACE, expected_file
from retouch.pages.objects.wrap_page import Preview, write_wrap_page
from retouch.verbs.objects.steering import without_steered
from retouch.verbs.objects.wrap_options import WrapOptions
from retouch.verbs.objects.wrap_task import Task, size_words, task_of, wrap_numbers
from retouch.verbs.progress_display import followed
from retouch.verbs.reliefs import Source

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
    preview: Preview
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
    check_page(page)
    with followed(options.progress, options.quiet), stage("preview"):
        task = task_of(texture, mesh, without_steered(options))
        with naming(mesh):
            preview = _preview(f"{_name(texture)} on {Path(mesh).stem}", task)
        with permitted(page):
            write_wrap_page(page, preview)
    return WrapPreview(page, preview, task.warnings)


def check_page(page: Path) -> None:
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


def _preview(title: str, task: Task) -> Preview:
    """The content of the page, by wrapping with few triangles, from which the file is estimated."""
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
