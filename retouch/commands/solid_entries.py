"""Print files and G-code in `retouch evaluate`: their options."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from optimize.settings.run_options import CURVED
from relief.ground.errors import InputError
from relief.ground.formats import MESHES, is_gcode
from retouch.commands.options import CORRECTIONS, LENGTHS, add, add_out


def add_meshes(parser: argparse.ArgumentParser) -> None:
    """Add the options of print files."""
    group = parser.add_argument_group("print files")
    text = "the object without texture, a file or one that comes with Retouch: its curvature is taken out "
    text += "exactly, and else estimated from each patch"
    add(group, "--object FILE", text, type=Path)
    text = "press on the texture where it lies on the --object, and take out what the bare object strains: "
    text += "what a texture was steered for with --curved-x-mm"
    add(group, "--on-shape", text)
    text = "folder for the mesh in the colours of its roughness: NAME-roughness.html, a page, .glb and .png"
    add_out(group, "FOLDER", text)


def add_filament(parser: argparse.ArgumentParser) -> None:
    """Add the options of G-code and of slicers."""
    group = parser.add_argument_group("filament")
    text = "G-code of another print of the same part, felt at the same places"
    add(group, "--beside GCODE", text, type=Path)
    text = "press on a height map as this slicer prints it, lying on the bed; of the result of a run, also "
    text += "what is left of its change (default with --profile: prusa-slicer)"
    add(group, "--slicer PROGRAM", text)
    add(group, "--profile FILE", "settings of the slicer, as it exports them (.ini)", type=Path)


def check_solid_options(arguments: argparse.Namespace, textures: Sequence[Path]) -> None:
    """Raise InputError for options that do not fit the files: textures, print files, G-code or several."""
    gcode = sum(map(is_gcode, arguments.textures))
    solids = len(arguments.textures) - len(textures)
    meshes = solids - gcode
    print_files = f"print files ({', '.join(MESHES)})"
    names = [name for name in (*LENGTHS, *CORRECTIONS) if name != "height_scale" or not arguments.units]
    repeats = "--no-repeats" if arguments.repeats is False else "--repeats"
    of_reliefs = "--reach", "--readouts", "--finger", repeats, *map(_flag, CURVED)
    rules = (
        (("--object", "-o"), solids, f"is for {print_files} and G-code; none is given"),
        (("--on-shape",), meshes, f"is for {print_files}; none is given"),
        (("--on-shape",), arguments.object, "needs --object, the object without texture"),
        (("--on-shape",), arguments.model != "net", "the net is of flat objects; use --model layer"),
        (("--beside",), gcode == 1 == len(arguments.textures), "is for one file of G-code"),
        (("--units",), meshes or textures or arguments.object, "is for height maps and print files"),
        (("--printer",), not gcode, "is for height maps and print files; G-code is a print"),
        (("--printer",), arguments.profile is None, "does not go with --profile: beads are a print"),
        (("--slicer",), arguments.profile is not None, "needs --profile, the slicer's settings"),
        (
            ("--slicer", "--profile"),
            not solids and not arguments.reach and not arguments.readouts,
            "is for height maps, without --reach and --readouts",
        ),
        (map(_flag, names), textures, "is for height maps; --units states the unit of a print file"),
        (of_reliefs, not solids, "is for height maps; print files and G-code are felt as they are"),
    )
    stated = {_flag(name): value for name, value in vars(arguments).items()}
    stated |= {"-o": arguments.out, repeats: arguments.repeats is not None}
    for flags, fits, words in rules:
        for flag in flags:
            if not fits and stated[flag] is not None and stated[flag] is not False:
                raise InputError(f"{flag}: {words}")
    if arguments.out is not None and arguments.out.exists() and not arguments.out.is_dir():
        raise InputError(f"{arguments.out}: -o: is no folder")


def _flag(name: str) -> str:
    """The option of an attribute."""
    return "--" + name.replace("_", "-")
