"""Evaluation of solids and of G-code: how they are read and pressed, and what is said of them."""

import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from optimize.verification.solids.bead_feel import feel_of_beads as feel_of_beads
from optimize.verification.solids.mesh_feel import ESTIMATED, PLATE, TAKEN_OUT, UNDER, MeshFeel, feel_of
from relief.ground.errors import naming
from relief.ground.formatting import number
from relief.ground.limits import MOST_MESH_PLACES
from relief.ground.progress import say, stage
from relief.printers import Printer
from relief.solids.export.printed_parts import PrintedPart, print_part
from relief.solids.filament.beads import SlicedPart
from relief.solids.filament.gcode_reader import read_gcode as parsed_gcode
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.mending.repair import mended
from relief.solids.meshes.solid import outer_body
from relief.solids.objects.table import OBJECTS
from retouch.pages.objects.mesh_colouring import write_coloured
from retouch.pages.sentences import print_deviation
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin


def read_solid(path: str | os.PathLike[str], *, units: str | None = None) -> Mesh:
    """Read a print file, which must be a solid, or make an object that comes with Retouch.

    Where its faces pass through one another, or parts lie within others, the outer surface is taken: a finger
    meets nothing else. Cracks are closed, and slivers and repeated faces dropped. Lines say so.

    Args:
        path: STL, OBJ, PLY, GLB, 3MF or STEP, or the name of a bundled object.
        units: of the file, where it does not state its own or a wrong one: "um", "mm", "cm", "m", "in" or
            "ft".

    Raises:
        InputError: the file cannot be read, or its mesh is open, inverted or without volume.
    """
    path = Path(path)
    if (thing := OBJECTS.get(str(path))) is not None:
        return Mesh(thing.make(), None, path)
    mesh = read_mesh(path, units=units)
    for line in mesh.warnings:
        say(f"{path}: {line}")
    work = mended(mesh.body, path)
    body, crossings = outer_body(work.body, path)
    lines = (*work.lines, *crossings)
    for line in lines:
        say(f"{path}: {line}")
    return replace(mesh, body=body, uv=None, warnings=(*mesh.warnings, *lines), folded=bool(crossings))


def press_solid(
    mesh: Mesh,
    without_texture: Mesh | None,
    model: ModelName,
    skin: Skin,
    printer: Printer | None,
    on_shape: bool,
) -> tuple[MeshFeel, PrintedPart | None]:
    """How a solid feels, and what the printer makes of it if one is named; arguments as of `evaluate`.

    Raises:
        InputError: what is wrong with the solid, which the message names.
        ContactError: a contact does not converge.
    """
    with naming(mesh.path), stage(f"feeling {mesh.path.name}"):
        printed = None if printer is None else print_part(mesh.body, printer)
        body = None if printed is None else printed.body
        return feel_of(mesh, skin, model, MOST_MESH_PLACES, without_texture, body, on_shape), printed


def write_colours(
    folder: str | os.PathLike[str] | None, solid: Mesh | SlicedPart, feel: MeshFeel, skin: str
) -> tuple[Path, ...]:
    """Write the files that show the roughness of a solid in colours, if a folder is named."""
    if folder is None:
        return ()
    return write_coloured(Path(folder), solid.path.stem, feel, Path(skin).stem)


def solid_lines(name: str, felt: MeshFeel, printed: PrintedPart | None) -> Iterator[str]:
    """Sentences for a person about a solid of this name, and about its print."""
    sides = " x ".join(number(side) for side in felt.sides_mm)
    if felt.curvature == PLATE:
        own = "Its back is flat and its sides are upright; a curvature of its own is taken out by --object"
    else:
        own = f"The object's own curvature is {felt.curvature}"
    if felt.curvature == ESTIMATED:
        own += f"; with it roughness is {number(float(felt.as_pressed[ROUGHNESS.name].mean()))}"
    yield f"{name} ({sides} mm): {_pressed_places(felt)}. {own}."
    if printed is not None:
        yield f"As printed by {printed.printer.name}: {print_deviation(printed.rms_mm, printed.lost)}"


def _pressed_places(felt: MeshFeel) -> str:
    """Where the finger pressed on a solid, and which places were left out."""
    count = len(felt.crops)
    if felt.curvature == PLATE:
        over = f"; {felt.edges} over its outline or holes are left out" if felt.edges else ""
        return f"a plate: felt as its height map, at {count} contact location{'s' * (count > 1)}{over}"
    pressed = "felt at one place" if count == 1 else f"mean over {count} places"
    if felt.crops[0].on_edge:
        where = "on an edge" if count == 1 else "all on edges"
        return (
            f"{pressed}, {where}, where a finger feels the shape (of a plate as small as a finger, "
            "evaluate the height map or the folder of its run)"
        )
    if felt.curvature in (TAKEN_OUT, UNDER):
        return f"{pressed}; {felt.edges} on edges or without texture are left out"
    return f"{pressed}; {felt.edges} on edges and {felt.flat} flat ones are left out"


def read_gcode(path: str | os.PathLike[str]) -> SlicedPart:
    """Read the beads of a file of G-code, and print what a reader of its numbers should know.

    Args:
        path: .gcode, .gcode.3mf or .bgcode.

    Raises:
        InputError: the file cannot be read, is cut off, or holds no beads of a part.
    """
    part = parsed_gcode(Path(path))
    for line in part.warnings:
        say(f"{path}: {line}")
    return part


def part_lines(part: SlicedPart, felt: MeshFeel) -> Iterator[str]:
    """A sentence for a person about a sliced part and its places."""
    sides = " x ".join(number(side) for side in felt.sides_mm)
    slicer = f"{part.slicer}, " if part.slicer else ""
    count = len(felt.crops)
    places = "felt at one place" if count == 1 else f"mean over {count} places"
    if felt.crops[0].on_edge:
        places += ", on an edge" if count == 1 else ", all on edges, where a finger feels the shape"
    elif felt.edges:
        places += f"; {felt.edges} on edges are left out"
    yield f"{part.path} ({slicer}{sides} mm): {places}. The part's own curvature is {felt.curvature}."
