"""The page of `retouch wrap --preview`: the object before and after, and what the file will come to."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array
from relief.ground.formatting import about, number, percent
from relief.solids.body import Body
from relief.solids.export.printed_parts import PrintedPart
from relief.solids.wrapping.wrapped_body import Wrapped
from retouch.pages.objects.object_page import Card, write_object_page
from retouch.pages.objects.wrap_sentences import wrapped_sentences
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
    layers = [
        ColourLayer(
            "Texture",
            _mixed(shown.textured, TEXTURED),
            key((TEXTURED, "carries the texture"), (BARE, "stays as it is")),
        )
    ]
    if shown.seams.any():
        seams = ColourLayer(
            "Seams",
            _mixed((shown.seams & (shown.textured > 0.0)).astype(float), SEAM),
            key((SEAM, "patches that do not fit one another are blended")),
        )
        layers.append(seams)
    if shown.lowering.part > 0.0:
        layers.append(
            ColourLayer(
                "Lowered",
                _mixed((1.0 - shown.factor) * (shown.textured > 0.0), LOWERED),
                key((BARE, "full height"), (LOWERED, "nothing is left of the relief; paler colours: less")),
            )
        )
    before = ViewerModel("before", Body(shown.original.vertices, shown.body.faces), layers)
    after = ViewerModel("after", shown.body, layers)
    if preview.printed is not None:
        after = _as_printed(preview.printed, shown, layers)
    figure = viewer_figure(f"{preview.title}, before and {after.name}", before, after)
    return write_object_page(
        path, "preview", preview.title, _deck(preview), figure, _cards(preview), _notes(preview)
    )


def _as_printed(printed: PrintedPart, shown: Wrapped, layers: list[ColourLayer]) -> ViewerModel:
    """The object as a printer makes it; layers of colour stay where the print has the same vertices."""
    kept = layers if len(printed.body.vertices) == len(shown.body.vertices) else []
    return ViewerModel(f"printed by {printed.printer.name}", printed.body, kept)


def _mixed(share: Array, colour: str) -> Array:
    """Colours (n, 3) from that of what is bare, at a share of 0, to another, at 1; sRGB from 0 to 1."""
    bare, full = (np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0 for text in (BARE, colour))
    return np.asarray(bare + share[:, None] * (full - bare))


def _deck(preview: Preview) -> str:
    time, unit = about(preview.seconds)
    return (
        f"What retouch wrap will make in about {time} {unit}, shown on {_thousands(preview)} triangles. "
        "Nothing is written yet but this page."
    )


def _thousands(preview: Preview) -> str:
    return f"{round(len(preview.shown.body.faces), -3):,}"


def _cards(preview: Preview) -> list[Card]:
    shown, (time, unit) = preview.shown, about(preview.seconds)
    extents = np.ptp(shown.body.vertices, axis=0)
    sides = " × ".join(f"{side:.3g}" for side in extents)
    return [
        Card(
            "Longest side",
            f"{extents.max():.3g}",
            "mm",
            f"{sides} mm with the texture, which lies on {number(shown.area_mm2)} mm²",
        ),
        Card(
            "Triangles",
            f"{preview.faces / 1e6:.2g}" if preview.faces >= 1e6 else f"{round(preview.faces, -3) // 1000}",
            "million" if preview.faces >= 1e6 else "thousand",
            f"about, with edges of {preview.edge_mm:.2g} mm where the texture lies",
        ),
        Card("File", f"{preview.bytes / 2**20:.2g}", "MiB", "about, as 3MF; an STL takes 2.5 times as much"),
        Card("Time", time, unit, "about, for retouch wrap on this computer"),
    ]


def _notes(preview: Preview) -> list[str]:
    shown = preview.shown
    notes = [
        f"The relief is that of the file, on triangles with edges of {shown.edge_mm:.2g} mm; the file's are "
        f"{preview.edge_mm:.2g} mm long. Finer grains than the triangles shown are missing here.",
    ]
    if shown.coordinates == "patches":
        notes.append(
            f"The texture lies in {shown.patches} patches, which are blended on "
            f"{percent(100.0 * shown.blended)} of it. Those of the file lie much the same, but not exactly."
        )
    elif shown.coordinates == "texture coordinates":
        notes.append("The texture lies by the texture coordinates of the mesh, as in the file.")
    notes += wrapped_sentences(shown)
    if preview.printed is not None:
        print_ = preview.printed
        lost = (
            f"; {percent(100.0 * print_.lost)} of it is too thin to be printed" if print_.lost > 5e-4 else ""
        )
        notes.append(
            f"Shown is the print by {print_.printer.name}, whose layers lie across z. It is "
            f"{number(1000.0 * print_.rms_mm, 2)} µm (rms) from the surface of these triangles{lost}."
        )
    notes.append("Whether the surface passes through itself is found out by retouch wrap alone.")
    return notes
