"""`retouch export`: a texture as a plate for a 3-D printer, or as displacement for a modelling program."""

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mitsuba_scenes import find_texture
from relief.common.errors import InputError
from relief.common.formats import DISPLACEMENT, FORMATS
from relief.common.limits import BASE_MM
from relief.printers import find_printer
from retouch.commands.options import (
    TEXTURE,
    add_plate,
    add_printer,
    add_talk,
    check_scales,
    print_json,
)

if TYPE_CHECKING:
    from relief.common.arrays import Array
    from relief.printers import Printer
    from relief.surface import Surface

HELP = "write a texture as a plate for a 3-D printer, or for a modelling program"
DESCRIPTION = (
    "Writes the relief on a base as one watertight body, or as a picture by which a modelling program\n"
    "displaces a surface.\n\nformats:\n"
    + "".join(f"  {suffix}  {plate.description}\n" for suffix, plate in FORMATS.items())
    + f"  {DISPLACEMENT}  displacement, 16-bit grey: black is 0, white the highest point\n"
)
EPILOG = """\
examples:
  retouch export stone.png --relief-mm 1.2 -o stone.3mf
  retouch export runs/stone --base-mm 3 -o stone.stl
  retouch export gravel-tile --repeat 3x3 -o gravel.3mf
  retouch export runs/stone -o stone.png
  retouch export gravel --printer mask-50 -o gravel.3mf
"""
MOST_REPEATS = 256
"""Most times that a tile of the fewest samples, 16 a side, fits into the most, 4096."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "texture",
        type=Path,
        metavar="TEXTURE",
        help=TEXTURE,
    )
    parser.add_argument(
        "-o",
        dest="out",
        type=Path,
        required=True,
        metavar="OUT",
        help=f"file to write: {', '.join((*FORMATS, DISPLACEMENT))}",
    )
    add_plate(parser)
    parser.add_argument(
        "--base-mm",
        type=float,
        metavar="MM",
        help=f"thickness of the plate under height 0, mm (default: {BASE_MM:g}; whole layers of a printer)",
    )
    add_printer(parser, "write the print that this printer makes, in flat pixels", "that of the run, or none")
    parser.add_argument(
        "--repeat",
        type=times,
        default=(1, 1),
        metavar="NxM",
        help="repeat a tile N times across and M down; --size-mm is the side of one (default: 1x1)",
    )
    add_talk(parser, "file, size and thickness", quiet=False)


def times(text: str) -> tuple[int, int]:
    """Read `3x2`, 3 across and 2 down, as (down, across). Raises argparse.ArgumentTypeError."""
    found = re.fullmatch(r"([0-9]{1,3})x([0-9]{1,3})", text)
    across, down = (int(number) for number in found.groups()) if found else (0, 0)
    if not (1 <= across <= MOST_REPEATS and 1 <= down <= MOST_REPEATS):
        raise argparse.ArgumentTypeError(
            f"{text[:20]!r}: expected two numbers from 1 to {MOST_REPEATS}, as in 3x2"
        )
    return down, across


def run(arguments: argparse.Namespace) -> int:
    # Imported here, so that --help needs no numpy.
    from relief.common.lengths import RANGES
    from relief.export.plate import repeated
    from relief.relief import Relief

    out, times = arguments.out, arguments.repeat
    own = _printer_of(arguments.texture)
    if own is not None and arguments.printer is not None:
        raise InputError(f"--printer: the run in {arguments.texture} has a printer already, {own.name}")
    arguments.texture = find_texture(arguments.texture)
    check_scales(arguments, [arguments.texture])
    _check_out(arguments)
    tile = Relief.read(arguments.texture, **{key: getattr(arguments, key) for key in RANGES})
    relief = Relief(
        repeated(tile.heights, times, tile.name), tile.width_mm * times[1], name=str(arguments.texture)
    )
    printer = own
    if arguments.printer is not None:
        printer = find_printer(arguments.printer)
        relief = relief.printed(printer)
    heights, surface = relief.heights, relief.surface
    try:
        if out.suffix.lower() == DISPLACEMENT:
            numbers, sentence = _write_displacement(out, heights, surface)
        else:
            numbers, sentence = _write_plate(out, heights, surface, arguments.base_mm, printer)
    except PermissionError as error:
        # The message of the error names a temporary file.
        raise InputError(f"{out}: -o: {error.strerror}") from error
    bytes_ = out.stat().st_size
    if arguments.json:
        told = {"file": str(out), "size_mm": surface.width_mm, **numbers, "bytes": bytes_}
        print_json(told | {"printer": None if printer is None else printer.name})
    else:
        by = f", as printed by {printer.name}" if printer else ""
        print(f"{out}: {sentence}{by}, {bytes_ / 2**20:.1f} MiB")
    return 0


def _printer_of(folder: Path) -> "Printer | None":
    """The printer whose pixels and layers the result of a run has. Raises InputError."""
    from optimize.run_directory.key import SETTINGS

    if not (folder / SETTINGS).is_file():
        return None
    from optimize.settings.run_file import load_run

    return load_run(folder / SETTINGS).print.described


def _check_out(arguments: argparse.Namespace) -> None:
    """Refuse what cannot be written before anything is read. Raises InputError."""
    out, texture = arguments.out, arguments.texture
    if not out.parent.is_dir():
        raise InputError(f"{out}: -o: there is no folder {out.parent}")
    if out.is_dir():
        raise InputError(f"{out}: -o: is a folder")
    if out.exists() and texture.exists() and out.samefile(texture):
        raise InputError(f"{out}: -o: is the texture itself")
    if out.suffix.lower() == DISPLACEMENT and arguments.base_mm is not None:
        raise InputError(f"--base-mm: is for plates; {out.name} holds heights alone")


def _write_plate(
    out: Path, heights: "Array", surface: "Surface", base_mm: float | None, printer: "Printer | None"
) -> tuple[dict[str, Any], str]:
    """Write a plate, of flat pixels if it is a print; returns its numbers for `--json`, and what is told."""
    from relief.export.plate import export_plate

    if base_mm is None:
        base_mm = BASE_MM if printer is None else printer.base_mm
    export_plate(out, heights, surface.width_mm, base_mm, stepped=printer is not None)
    thick = base_mm + float(heights.max())
    sides = f"{surface.width_mm:.4g} x {surface.height_mm:.4g} x {thick:.3g} mm"
    return {"thickness_mm": thick}, sides


def _write_displacement(out: Path, heights: "Array", surface: "Surface") -> tuple[dict[str, Any], str]:
    """Write a 16-bit picture of heights; returns its numbers for `--json`, and what is told."""
    from relief.common.limits import SMALLEST_RELIEF_MM
    from relief.heightmap import save_heights_png

    white = max(float(heights.max()), SMALLEST_RELIEF_MM)
    save_heights_png(out, heights, white, surface.width_mm)
    told = (
        f"{surface.width_mm:.4g} x {surface.height_mm:.4g} mm, black is 0 and white {white:.6g} mm; "
        f"displace by strength {white:.6g} mm, midlevel 0, colours read as data (Non-Color)"
    )
    return {"height_mm": surface.height_mm, "strength_mm": white, "midlevel": 0.0, "bits": 16}, told
