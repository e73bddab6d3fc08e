"""`retouch export`: a texture as a watertight plate for a 3-D printer."""

import argparse
from pathlib import Path

from mitsuba_scenes import find_texture
from optimize.commands.options import TEXTURE, add_plate, add_talk, check_scales, print_json
from relief.errors import InputError
from relief.formats import FORMATS
from relief.limits import BASE_MM

HELP = "write a texture as a plate for a 3-D printer"
DESCRIPTION = "Writes the relief on a base as one watertight body, in mm.\n\nformats:\n" + "".join(
    f"  {suffix}  {plate.description}\n" for suffix, plate in FORMATS.items()
)
EPILOG = """\
examples:
  retouch export stone.png --relief-mm 1.2 -o stone.3mf
  retouch export runs/stone/heights.exr --base-mm 3 -o stone.stl
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "texture",
        type=Path,
        metavar="TEXTURE",
        help=TEXTURE,
    )
    parser.add_argument(
        "-o", dest="out", type=Path, required=True, metavar="OUT", help=f"file to write: {', '.join(FORMATS)}"
    )
    add_plate(parser)
    parser.add_argument(
        "--base-mm",
        type=float,
        default=BASE_MM,
        metavar="MM",
        help=f"thickness of the plate under height 0, mm (default: {BASE_MM:g})",
    )
    add_talk(parser, "file, size and thickness", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    # Imported here, so that --help needs no numpy.
    from relief.export import export_plate
    from relief.heightmap import load_height_map
    from relief.lengths import RANGES
    from relief.surface import Surface

    out, base_mm = arguments.out, arguments.base_mm
    arguments.texture = find_texture(arguments.texture)
    check_scales(arguments, [arguments.texture])
    if not out.parent.is_dir():
        raise InputError(f"{out}: -o: there is no folder {out.parent}")
    if out.is_dir():
        raise InputError(f"{out}: -o: is a folder")
    read = load_height_map(arguments.texture, **{key: getattr(arguments, key) for key in RANGES})
    heights, size_mm = read.heights, read.side_mm
    try:
        export_plate(out, heights, size_mm, base_mm)
    except PermissionError as error:
        # The message of the error names a temporary file.
        raise InputError(f"{out}: -o: {error.strerror}") from error
    thick = base_mm + float(heights.max())
    if arguments.json:
        bytes_ = out.stat().st_size
        print_json({"file": str(out), "size_mm": size_mm, "thickness_mm": thick, "bytes": bytes_})
        return 0
    surface = Surface((heights.shape[0], heights.shape[1]), size_mm)
    sides = f"{surface.width_mm:.4g} x {surface.height_mm:.4g} x {thick:.3g} mm"
    print(f"{out}: {sides}, {out.stat().st_size / 2**20:.1f} MiB")
    return 0
