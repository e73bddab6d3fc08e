"""`retouch export`: a texture as a closed plate for a 3-D printer."""

import argparse
from pathlib import Path

from optimize.commands.options import add_plate
from relief.limits import BASE_MM, PATCH_SIDE_MM

HELP = "write a texture as a plate for a 3-D printer"
DESCRIPTION = """\
Writes the relief on a base as one watertight body, in mm: .3mf, which states its unit and is the safer
choice; .stl, where the slicer must be told millimetres; .ply, for Blender and MeshLab.
"""
EPILOG = """\
examples:
  retouch export stone.png --relief-mm 1.2 -o stone.3mf
  retouch export runs/stone/heights.exr --base-mm 3 -o stone.stl
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "texture", type=Path, metavar="TEXTURE", help="height map: PNG, TIFF (grey is height), EXR, NPY (mm)"
    )
    parser.add_argument(
        "-o",
        dest="out",
        type=Path,
        required=True,
        metavar="OUT",
        help="the file to write: .3mf, .stl or .ply",
    )
    add_plate(parser, f"{PATCH_SIDE_MM:g}", "none, and needed, for PNG and TIFF; EXR and NPY hold mm")
    parser.add_argument(
        "--base-mm",
        type=float,
        default=BASE_MM,
        metavar="MM",
        help=f"thickness under height 0 (default: {BASE_MM:g})",
    )


def run(arguments: argparse.Namespace) -> int:
    from relief.errors import InputError
    from relief.export import export_plate
    from relief.heightmap import load_heights

    out, base_mm = arguments.out, arguments.base_mm
    size_mm = PATCH_SIDE_MM if arguments.size_mm is None else arguments.size_mm
    if not out.parent.is_dir():
        raise InputError(f"{out}: -o: there is no folder {out.parent}")
    if out.is_dir():
        raise InputError(f"{out}: -o: is a folder")
    heights = load_heights(arguments.texture, relief_mm=arguments.relief_mm)
    try:
        export_plate(out, heights, size_mm, base_mm)
    except PermissionError as error:
        # The error names a temporary file.
        raise InputError(f"{out}: -o: {error.strerror}") from error
    thick = base_mm + float(heights.max())
    print(f"{out}: {size_mm:g} x {size_mm:g} x {thick:.3g} mm, {out.stat().st_size / 2**20:.1f} MiB")
    return 0
