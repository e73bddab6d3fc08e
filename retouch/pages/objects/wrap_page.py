"""The page of `retouch wrap --preview`: the object before and after, and what the file will come to."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array
from relief.ground.files import write_atomically
from relief.ground.formatting import about
from relief.solids.body import Body
from relief.solids.export.printed_parts import PrintedPart
from relief.solids.wrapping.wrapped_body import Wrapped
from retouch.pages.objects.wrap_sentences import wrapped_sentences
from retouch.pages.rendering import render_page
from retouch.pages.viewer.figure import key, viewer_figure
from retouch.pages.viewer.models import ColourLayer, ViewerModel

BARE, TEXTURED, SEAM, LOWERED = "#d8d3ca", "#2f7f96", "#c2560f", "#8a3ffc"
"""Colours of what carries no texture, of what does, of what patches that do not fit share, and of where
nothing is left of the relief."""


@dataclass(frozen=True, eq=False)
class Preview:
    """What is known before a wrapping.

    Attributes:
        title: names of the texture and the object.
        shown: the object, wrapped with few triangles.
        edge_mm: longest edge of the textured triangles of the file, mm.
        faces: of the file, about.
        bytes: of the file as 3MF, about.
        seconds: that the whole will take, about.
        printed: what the printer makes of what is shown that is named; None without one.
    """

    title: str
    shown: Wrapped
    edge_mm: float
    faces: int
    bytes: int
    seconds: float
    printed: PrintedPart | None = None


def write_wrap_page(path: Path, preview: Preview) -> Path:
    """Write the page, atomically; it is one file that fetches nothing from a network.

    Returns:
        The path of the page.
    """
    shown = preview.shown
    on_texture = shown.textured > 0.0
    textured = key((TEXTURED, "carries the texture"), (BARE, "stays as it is"))
    layers = [ColourLayer("Texture", _mixed(shown.textured, TEXTURED), textured)]
    if shown.seams.any():
        blended = key((SEAM, "patches that do not fit one another are blended"))
        layers.append(ColourLayer("Seams", _mixed((shown.seams & on_texture).astype(float), SEAM), blended))
    if shown.lowering.part > 0.0:
        gone = key((BARE, "full height"), (LOWERED, "nothing is left of the relief; paler colours: less"))
        layers.append(ColourLayer("Lowered", _mixed((1.0 - shown.factor) * on_texture, LOWERED), gone))
    before = ViewerModel("before", Body(shown.original.vertices, shown.body.faces), layers)
    after = ViewerModel("after", shown.body, layers)
    if preview.printed is not None:
        after = _as_printed(preview.printed, shown, layers)
    figure = viewer_figure(f"{preview.title}, before and {after.name}", before, after)
    time, unit = about(preview.seconds)
    page = render_page(
        "wrap.html.j2",
        viewer=True,
        kind="preview",
        pair={"title": preview.title},
        figure=figure,
        preview=preview,
        shown=shown,
        sides=np.ptp(shown.body.vertices, axis=0).tolist(),
        sentences=wrapped_sentences(shown),
        time=time,
        unit=unit,
    )
    write_atomically(path, page)
    return path


def _as_printed(printed: PrintedPart, shown: Wrapped, layers: list[ColourLayer]) -> ViewerModel:
    """The object as a printer makes it; layers of colour stay where the print has the same vertices."""
    kept = layers if len(printed.body.vertices) == len(shown.body.vertices) else []
    return ViewerModel(f"printed by {printed.printer.name}", printed.body, kept)


def _mixed(share: Array, colour: str) -> Array:
    """Colours (n, 3) from that of what is bare, at a share of 0, to another, at 1; sRGB from 0 to 1."""
    bare, full = (np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0 for text in (BARE, colour))
    return np.asarray(bare + share[:, None] * (full - bare))
