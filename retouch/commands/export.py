"""`retouch export`: write a texture as a plate for a 3-D printer, or for a modelling program.

Writes the relief on a base as one watertight body, or as a picture by which a modelling program
displaces a surface.

formats:
{PLATES}  {DISPLACEMENT}  displacement, 16-bit grey: black is 0, white the highest point

examples:
  retouch export stone.png --relief-mm 1.2 -o stone.3mf
  retouch export runs/stone --base-mm 3 -o stone.stl
  retouch export gravel-tile --repeat 3x3 -o gravel.3mf
  retouch export runs/stone -o stone.png
  retouch export gravel-tile --tile -o tile.png
  retouch export gravel --printer mask-50 -o gravel.3mf
  retouch export --coupon -o coupon.3mf
"""

import argparse
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import retouch
from relief.ground.errors import InputError
from relief.ground.formats import DISPLACEMENT, FORMATS
from relief.ground.limits import BASE_MM
from relief.ground.options import given
from retouch.commands import options

if TYPE_CHECKING:
    from retouch.verbs.exporting import Exported

PLATES = "".join(f"  {suffix}  {plate.description}\n" for suffix, plate in FORMATS.items())
MOST_REPEATS = 256
"""Most times that a tile of the fewest samples, 16 a side, fits into the most, 4096."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    options.add(parser, "texture TEXTURE", options.TEXTURE, type=Path, nargs="?")
    text = "write, in place of a texture, a plate by whose scan a printer is measured (retouch scan "
    text += "--coupon); --printer chooses its size"
    options.add(parser, "--coupon", text)
    options.add_out(parser, "OUT", f"file to write: {', '.join((*FORMATS, DISPLACEMENT))}", required=True)
    options.add_plate(parser)
    text = f"thickness of the plate under height 0, mm (default: {BASE_MM:g}; whole layers of a printer)"
    options.add(parser, "--base-mm MM", text, type=float)
    text = "write the print that this printer makes, in flat pixels"
    options.add_printer(parser, text, "that of the run, or none")
    text = "repeat a tile N times across and M down; --size-mm is the side of one (default: 1x1)"
    options.add(parser, "--repeat NxM", text, type=times, default=(1, 1))
    text = "write a seamless picture, its lowest point black, and beside it a page (.html) of the numbers "
    text += "to type into BumpMesh and Blender"
    options.add(parser, "--tile", text, action="store_true", default=None)
    options.add_talk(parser, "file, size and thickness", quiet=False)


def times(text: str) -> tuple[int, int]:
    """Read `3x2`, 3 across and 2 down, as (down, across). Raises argparse.ArgumentTypeError."""
    match = re.fullmatch(r"([0-9]{1,3})x([0-9]{1,3})", text)
    across, down = (int(number) for number in match.groups()) if match else (0, 0)
    if not (1 <= across <= MOST_REPEATS and 1 <= down <= MOST_REPEATS):
        raise argparse.ArgumentTypeError(
            f"{text[:20]!r}: expected two numbers from 1 to {MOST_REPEATS}, as in 3x2"
        )
    return down, across


def run(arguments: argparse.Namespace) -> int:
    exported = _coupon(arguments) if arguments.coupon else _texture(arguments)
    return options.report(arguments, exported.as_json(), _lines(exported))


def _lines(exported: "Exported") -> Iterator[str]:
    """What was written, for a person."""
    sides = f"{exported.width_mm:.4g} x {exported.height_mm:.4g}"
    if exported.thickness_mm is not None:
        sentence = f"{sides} x {exported.thickness_mm:.3g} mm"
    else:
        sentence = (
            f"{sides} mm, black is 0 and white {exported.strength_mm:.6g} mm; displace by strength "
            f"{exported.strength_mm:.6g} mm, midlevel 0, colours read as data (Non-Color)"
        )
    by = f", as printed by {exported.printer.name}" if exported.printer else ""
    yield f"{exported.file}: {sentence}{by}, {exported.file.stat().st_size / 2**20:.1f} MiB"
    if exported.page:
        yield f"{exported.page}: the numbers to type into BumpMesh and Blender"


def _texture(arguments: argparse.Namespace) -> "Exported":
    if arguments.texture is None:
        raise InputError("texture: missing", "TEXTURE: missing; name a texture, or --coupon")
    return retouch.export(arguments.texture, **options.keywords(arguments, retouch.export))


def _coupon(arguments: argparse.Namespace) -> "Exported":
    """Write the coupon, which has its own size. Raises InputError."""
    others = given(arguments, "texture", "base_mm", "tile", *options.LENGTHS)
    if others or arguments.repeat != (1, 1):
        name = f"--{next(iter(others), 'repeat').replace('_', '-')}".replace("--texture", "TEXTURE")
        raise InputError(f"coupon: has its own {name}", f"{name}: is for textures; --coupon has its own size")
    return retouch.coupon(arguments.out, **given(arguments, "printer"))
