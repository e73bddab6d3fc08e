"""Options of `retouch wrap`, and keywords of `retouch.wrap` and `retouch.preview_wrap`."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from relief.ground.options import Option, ProgressKeywords
from relief.plate_options import TileOptions, printer_option
from relief.solids.wrapping.options import MeshOptions, PlacingOptions, SurfaceOptions

if TYPE_CHECKING:
    from relief.printers import Printer
    from retouch.verbs.reliefs import Source


def region(text: str) -> tuple[str, Path | float]:
    """Read MASK=TEXTURE, or MASK=CHANGE with a change of feel in JND. Raises argparse.ArgumentTypeError."""
    mask, equals, texture = (part.strip() for part in text.rpartition("="))
    if not (equals and mask and texture):
        raise argparse.ArgumentTypeError(f"{text!r}: expected MASK=TEXTURE, as in odd=grass-tile, or odd=+2")
    if texture[0] in "+-":
        try:
            return mask, float(texture)
        except ValueError:
            pass
    return mask, Path(texture)


@dataclass(frozen=True, kw_only=True)
class WrapOptions(ProgressKeywords, TileOptions, MeshOptions, SurfaceOptions, PlacingOptions):
    """How a tile is laid over an object."""

    GROUP: ClassVar = SurfaceOptions.GROUP

    regions: Annotated[
        Sequence[tuple[str, "Source | float"]],
        Option(
            "another texture where the mask is; or the change of feel in just-noticeable differences, as in "
            "odd=+2, for which the texture is optimised; may be given several times, later ones lie on top",
            "--region MASK=TEXTURE",
            python="pairs of a mask and another tile that lies there, later ones on top; or a number in "
            "place of the tile, for the same look with a feel that is so many just-noticeable differences "
            "rougher (+) or smoother (-): the tile is then optimised for the object's curvature there",
            read=region,
            several=True,
        ),
    ] = ()
    printer: Annotated[
        "str | Printer | None",
        printer_option(
            "triangles no finer than this printer shows, and what it makes of the object in layers across z",
            python="printer, or its name: triangles are no finer than it shows, and the result has what it "
            "makes in layers across z (default: none)",
        ),
    ] = None
