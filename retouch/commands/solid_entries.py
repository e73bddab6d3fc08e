"""Print files and G-code in `retouch evaluate`: their options."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from optimize.settings.run_options import CURVED
from relief.ground.errors import InputError
from relief.ground.formats import MESHES, is_gcode
from retouch.commands.options import CORRECTIONS, LENGTHS


def add_meshes(parser: argparse.ArgumentParser) -> None:
    """Add the options of print files."""
    group = parser.add_argument_group("print files")
    group.add_argument(
        "--object",
        type=Path,
        metavar="FILE",
        help="the object without texture, a file or one that comes with Retouch: its curvature is taken out "
        "exactly, and else estimated from each patch",
    )
    group.add_argument(
        "--on-shape",
        action="store_true",
        help="press on the texture where it lies on the --object, and take out what the bare object strains: "
        "what a texture was steered for with --curved-x-mm",
    )
    group.add_argument(
        "-o",
        dest="out",
        type=Path,
        metavar="FOLDER",
        help="folder for the mesh coloured by its roughness: NAME-roughness.html, a page that turns it, .glb "
        "and .png",
    )


def add_filament(parser: argparse.ArgumentParser) -> None:
    """Add the options of G-code and of slicers."""
    group = parser.add_argument_group("filament")
    group.add_argument(
        "--beside",
        type=Path,
        metavar="GCODE",
        help="G-code of another print of the same part, felt at the same places",
    )
    group.add_argument(
        "--slicer",
        metavar="PROGRAM",
        help="press on a height map as this slicer prints it, lying on the bed; of the result of a run, also "
        "what is left of its change (default with --profile: prusa-slicer)",
    )
    group.add_argument(
        "--profile", type=Path, metavar="FILE", help="settings of the slicer, as it exports them (.ini)"
    )


def check_solid_options(arguments: argparse.Namespace, textures: Sequence[Path]) -> None:
    """Raise InputError for options that do not fit the files: textures, print files, G-code or several."""
    gcode = sum(map(is_gcode, arguments.textures))
    solids = len(arguments.textures) - len(textures)
    meshes = solids - gcode
    for_meshes = {"--on-shape": arguments.on_shape or None}
    for_solids = {"--object": arguments.object, "-o": arguments.out}
    names = [name for name in (*LENGTHS, *CORRECTIONS) if name != "height_scale" or not arguments.units]
    for_textures = {"--" + name.replace("_", "-"): getattr(arguments, name) for name in names}
    for flag, value in for_meshes.items():
        if value is not None and not meshes:
            raise InputError(f"{flag}: is for print files ({', '.join(MESHES)}); none is given")
    for flag, value in for_solids.items():
        if value is not None and not solids:
            raise InputError(f"{flag}: is for print files ({', '.join(MESHES)}) and G-code; none is given")
    if arguments.beside is not None and (gcode != 1 or solids + len(textures) > 1):
        raise InputError("--beside: is for one file of G-code")
    if arguments.slicer is not None and arguments.profile is None:
        raise InputError("--slicer: needs --profile, the slicer's settings")
    if arguments.printer is not None and gcode:
        raise InputError("--printer: is for height maps and print files; G-code is a print")
    if arguments.printer is not None and arguments.profile is not None:
        raise InputError("--printer: does not go with --profile; a slicer's beads are the print")
    for flag, value in {"--slicer": arguments.slicer, "--profile": arguments.profile}.items():
        if value is not None and (solids or arguments.reach):
            raise InputError(f"{flag}: is for height maps and runs, without --reach")
    for flag, value in for_textures.items():
        if value is not None and not textures:
            raise InputError(f"{flag}: is for height maps; --units states the unit of a print file")
    for flag, stated in {
        "--reach": arguments.reach,
        "--no-repeats" if arguments.repeats is False else "--repeats": arguments.repeats is not None,
        **{f"--{name.replace('_', '-')}": getattr(arguments, name) is not None for name in CURVED},
    }.items():
        if stated and solids:
            raise InputError(f"{flag}: is for height maps; a print file is felt as it is")
    if arguments.on_shape and arguments.object is None:
        raise InputError("--on-shape: needs --object, the object without texture")
    if arguments.on_shape and arguments.model == "net":
        raise InputError("--on-shape: the net is trained for flat objects; use --model layer")
    if arguments.out is not None and arguments.out.exists() and not arguments.out.is_dir():
        raise InputError(f"{arguments.out}: -o: is no folder")
