"""`retouch scan`: say what a printer made of a design, from a scan of the print.

Registers the scan of a print with its design and reports turn, shift, scale, heights and blur, each with an
interval, what of the detail the printer lost, how the print feels and looks beside its design.

FILE: a height map (EXR, NPY or float TIFF in mm, not finite in holes; PNG or TIFF, grey), a mesh (STL, OBJ,
PLY, GLB, 3MF, STEP) with the relief upward, a file of a profilometer, or a text of points x, y, z in mm or of
heights on a grid (XYZ, TXT, CSV, ASC).

examples:
  retouch scan runs/stone print.stl
  retouch scan runs/stone print.png --size-mm 12 --relief-mm 0.9
  retouch scan runs/stone first.xyz --other second.xyz -o scans/both
  retouch scan --coupon coupon-scan.stl -o mine.toml
"""

import argparse
from dataclasses import replace
from pathlib import Path

import retouch
from mitsuba_scenes.fingers import DEFAULT_SKIN
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.options import add_option
from relief.plate_options import height_scale_option, relief_option, size_option
from retouch.commands import options

FOLDER = Path("scans")
"""Folder of the folders of scans where no other is given."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    options.add(parser, "design RUN", "run directory, or height map that was printed", type=Path, nargs="?")
    options.add(parser, "file FILE", "scan of the print", type=Path, nargs="?")
    options.add(parser, "--other FILE2", "scan of a second print, to be compared with the first", type=Path)
    text = "folder to write (default: scans/NAME of FILE); of a coupon, the printer file (.toml)"
    options.add_out(parser, "OUT", text)
    text = "unit of a mesh or of points, or of the heights in EXR, NPY and float TIFF (default: mm)"
    options.add(parser, "--units", text, choices=tuple(UNITS))
    height_scale = height_scale_option("1")
    height_scale = replace(height_scale, help=f"{height_scale.help}, or for a z of 1 of points")
    add_option(parser, "height_scale", height_scale, float)
    size = size_option("width of the scan of a height map", "the file's header")
    add_option(parser, "size_mm", size, float)
    add_option(parser, "relief_mm", relief_option("the file's header"), float)
    options.add_model(parser)
    options.add_skin(parser, f"the run's, or {DEFAULT_SKIN}")
    options.add_talk(parser, "every number")
    measured = parser.add_argument_group("a printer by its coupon")
    options.add(measured, "--coupon FILE", "scan of the coupon that retouch export --coupon wrote", type=Path)
    options.add_printer(measured, "printer that export was given for the coupon's size")
    options.add(measured, "--layer-um UM", "thickness of layers (default: as the scan shows)", type=float)
    options.add_pictures(parser)


def run(arguments: argparse.Namespace) -> int:
    if arguments.coupon is not None:
        return _coupon(arguments)
    file = arguments.file
    if file is None:
        missing = "RUN and FILE are needed, or --coupon FILE"
        raise InputError(f"file: missing; {missing}", missing)
    for name in ("printer", "layer_um"):
        if getattr(arguments, name) is not None:
            raise InputError(f"{name}: is for coupons; a run knows its printer")
    if not file.is_file():
        raise InputError(f"{file}: no such file")
    arguments.out = arguments.out or FOLDER / file.stem
    chosen = options.keywords(arguments, retouch.scan) | {"defines": dict(arguments.defines)}
    with options.contact_errors_name(file):
        scanned = retouch.scan(**chosen)
    return options.report(arguments, scanned.as_json(), scanned.lines())


def _coupon(arguments: argparse.Namespace) -> int:
    """Measure a printer. Raises InputError."""
    # Of two files the first would be taken for a run.
    if arguments.design is not None or arguments.other is not None:
        other = arguments.other or arguments.design
        raise InputError(f"coupon: one scan alone is taken; {other} is one file too many")
    if arguments.out is None:
        missing = "missing; the printer file to write, as in mine.toml"
        raise InputError(f"out: {missing}", f"-o: {missing}")
    arguments.file = arguments.coupon
    measured = retouch.scan_coupon(**options.keywords(arguments, retouch.scan_coupon))
    return options.report(arguments, measured.as_json(), measured.lines())
