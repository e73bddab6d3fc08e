"""Export: a relief as a plate for a 3-D printer, or as displacement for a modelling program."""

import logging
import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np

from mitsuba_scenes import find_texture
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import load_settings
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.files import check_file_to_write, permitted
from relief.ground.formats import DISPLACEMENT, FORMATS
from relief.ground.lengths import Lengths
from relief.ground.limits import BASE_MM, SMALLEST_RELIEF_MM
from relief.heightmap import check_scales, save_heights_png
from relief.printers import Printer, printer_of
from relief.relief import Relief
from relief.seam import check_seams
from relief.solids.export.plate_export import export_plate, repeated
from relief.surface import repeats_along
from retouch.verbs.reliefs import Source, relief_of

if TYPE_CHECKING:
    from optimize.runs.job import Result

_log = logging.getLogger(__name__)

MANY_TRIANGLES = 4_000_000
"""Triangles of a plate beyond which its size is reported before the work: those of 1400 x 1400 samples."""

MOST_PIXELS = 512
"""Longest side of a picture that BumpMesh 1.2 does not shrink, pixels."""


@dataclass(frozen=True)
class Exported:
    """A file of a plate or of a displacement.

    Attributes:
        file: that was written.
        width_mm, height_mm: sides along x and y, mm, of all tiles together.
        thickness_mm: of a plate, from its bottom to its highest point; None for a displacement.
        strength_mm: of a displacement, the height of white above black; None for a plate.
        printer: whose print the relief is; None if it is none's.
        page: of a tile, with the numbers that other programs take; None otherwise.
    """

    file: Path
    width_mm: float
    height_mm: float
    thickness_mm: float | None
    strength_mm: float | None
    printer: Printer | None
    page: Path | None = None

    def as_json(self) -> dict[str, Any]:
        """What `retouch export --json` prints."""
        numbers: dict[str, Any] = {"thickness_mm": self.thickness_mm}
        if self.thickness_mm is None:
            strength = {"strength_mm": self.strength_mm, "midlevel": 0.0, "bits": 16}
            numbers = {"height_mm": self.height_mm, **strength}
            numbers |= {"page": str(self.page)} if self.page else {}
        content = {"file": str(self.file), "size_mm": self.width_mm, **numbers}
        return content | {"bytes": self.file.stat().st_size, "printer": self.printer and self.printer.name}


def export(
    relief: "Source | Result",
    out: str | os.PathLike[str],
    *,
    base_mm: float | None = None,
    repeat: tuple[int, int] = (1, 1),
    printer: str | Printer | None = None,
    tile: bool = False,
    **lengths: Unpack[Lengths],
) -> Exported:
    """Write a relief on a base as one watertight body, or as a picture that displaces a surface.

    Args:
        relief: a `Relief`, heights (rows, cols) in mm, a height map, the name of a bundled one, the folder of
            a run, or what `optimize` returned.
        out: file to write: .3mf, .stl, .obj, .glb or .ply, a body; .png, a displacement of 16 bits.
        base_mm: thickness of the plate under height 0, mm; None: 2, or whole layers of the printer.
        repeat: how often a tile is repeated down and across; `size_mm` is the side of one.
        printer: name of a printer, or a printer, whose print is written, in flat pixels. The result of a run
            with a printer is a print already.
        tile: whether the picture is a seamless tile, its lowest point black, of up to 512 pixels or its
            own samples if they are more, with a page (.html) of the numbers to type into BumpMesh and
            Blender.
        lengths: `size_mm`, `relief_mm` and `height_scale` of a file, as in `Relief.read`; `size_mm` also
            of an array.

    Raises:
        InputError: the relief cannot be read or made, its sides do not fit as a tile, or the file cannot be
            written.
    """
    out = Path(out)
    source: Any = getattr(relief, "run_dir", relief)
    own = source.printer if isinstance(source, Relief) else None
    if isinstance(source, str | os.PathLike):
        own = _printer_of(Path(source))
        if own is not None and printer is not None:
            raise InputError(f"printer: the run in {source} has a printer already, {own.name}")
        source = find_texture(source)
        check_scales([source], lengths)
        if out.exists() and source.exists() and out.samefile(source):
            raise InputError(f"{out}: is the texture itself", f"{out}: -o: is the texture itself")
    check_file_to_write(out)
    if tile and out.suffix.lower() != DISPLACEMENT:
        raise InputError(f"tile: writes {DISPLACEMENT}; {out.name} is none")
    page = out.with_suffix(".html") if tile else None
    check_file_to_write(page or out)
    if out.suffix.lower() == DISPLACEMENT and base_mm is not None:
        raise InputError(f"base_mm: is for plates; {out.name} holds heights alone")
    one = relief_of(source, **lengths)
    if tile:
        check_seams(one.heights, (True, True), one.name)
    heights = repeated(one.heights, repeat, one.name)
    whole = Relief(heights, one.width_mm * repeat[1], name=one.name, printer=one.printer)
    made_by = printer_of(printer)
    whole = whole if made_by is None else whole.printed(made_by)
    whole = replace(whole, repeats=one.repeats)
    edge_mm = whole.surface.pitch_mm
    if tile:
        whole = replace(whole, heights=_finer(whole.heights), repeats=(True, True))
    with permitted(out):
        exported = _write(out, whole, base_mm, made_by or own)
        if page is not None and exported.strength_mm is not None:
            # Pages load their templates, and few exports have one.
            from retouch.pages.objects.tile_page import write_tile_page

            write_tile_page(page, out.name, whole.surface, exported.strength_mm, edge_mm)
    return replace(exported, page=page)


def _finer(heights: Array) -> Array:
    """Heights (rows, cols) of a tile above its lowest point, by cubic splines at a multiple of its samples.

    Programs go straight from pixel to pixel, which alone makes bundled tiles rougher by up to 0.5 JND.
    """
    from scipy import ndimage

    times = max(1, MOST_PIXELS // max(heights.shape))
    finer = ndimage.zoom(heights, times, order=3, mode="grid-wrap", grid_mode=True)
    finer = np.clip(finer, heights.min(), heights.max())
    return np.asarray(finer - finer.min())


def _printer_of(folder: Path) -> Printer | None:
    """The printer whose pixels and layers the result of a run has. Raises InputError."""
    settings = folder / SETTINGS
    return load_settings(settings).print.described if settings.is_file() else None


def _write(out: Path, relief: Relief, base_mm: float | None, printer: Printer | None) -> Exported:
    """Write a body, of flat pixels if it is a print, or a picture. Raises InputError."""
    width_mm, height_mm = relief.surface.width_mm, relief.surface.height_mm
    highest = float(relief.heights.max())
    if out.suffix.lower() == DISPLACEMENT:
        white = max(highest, SMALLEST_RELIEF_MM)
        layer_um = None if printer is None else printer.layer_um
        save_heights_png(out, relief.heights, white, width_mm, repeats_along(relief.repeats), layer_um)
        return Exported(out, width_mm, height_mm, None, white, printer)
    if base_mm is None:
        base_mm = BASE_MM if printer is None else printer.base_mm
    _foretell(out, relief, stepped=printer is not None)
    export_plate(out, relief.heights, width_mm, base_mm, stepped=printer is not None)
    return Exported(out, width_mm, height_mm, base_mm + highest, None, printer)


def _foretell(out: Path, relief: Relief, stepped: bool) -> None:
    """Say how large the file of a plate of very many triangles will be."""
    rows, cols = (side * (2 if stepped else 1) for side in relief.heights.shape)
    triangles = 2 * (rows + 1) * (cols + 1)
    if triangles > MANY_TRIANGLES:
        megabytes = triangles * FORMATS[out.suffix.lower()].triangle_bytes / 1e6
        size = f"{triangles / 1e6:.1f} million triangles, about {megabytes:.0f} MB; slicers may be slow"
        _log.warning("%s: %s; fewer samples make fewer (retouch prepare --samples)", out, size)
