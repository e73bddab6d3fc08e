"""`retouch wrap`: a tile on an object, with the same size in mm everywhere."""

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import retouch
from relief.ground.errors import InputError
from relief.ground.formats import FORMATS, UNITS
from relief.ground.formatting import about
from retouch.commands.mesh_entries import print_words
from retouch.commands.options import (
    CURVED,
    LENGTHS,
    TEXTURE,
    add_plate,
    add_printer,
    add_talk,
    given,
    print_json,
)

OBJECTS = "starfish, bracelet, slider, frog, curved, ball, cylinder"
"""Names of the bundled objects, as the help lists them."""

LEAST_TOLD = 0.005
"""Part of the area from which on it is told that lengths are off there."""
PROJECTIONS = ("auto", "cylinder", "sphere", "plane", "uv", "patches")
"""What may flatten the surface, as the help lists it."""
PLACING = ("projection", "along", "turn_deg", "offset_mm", "at")
"""Options of direction and place, by the names of arguments."""

HELP = "lay a tile over an object"
DESCRIPTION = f"""\
Displaces the surface of a mesh by a texture that repeats, along the normals, with the same size in mm
everywhere: by the mesh's texture coordinates where they keep sizes, around a cylinder without a seam, else by
flat patches that are turned to fit one another and blended where they cannot. A texture whose sides do not
fit is placed once. A solid comes out as a solid; a flat bottom stays flat.

meshes: STL, OBJ, PLY, GLB, 3MF, or an object that comes with Retouch by its name:
  {OBJECTS}

masks, joined by & or |, with not and parentheses:
  "z>2"          above z = 2 mm; the texture grows over the falloff, "z>2..5" from z = 2 to z = 5; x and y too
  "angle<60"     normals within 60 degrees of +z; "angle:-x<30" within 30 degrees of -x
  "turn>90"      angle about z through the middle of the object, degrees from +x
  mask.png       a picture over the mesh's texture coordinates, white carries the texture
  colour         colours of a PLY, OBJ or GLB: white carries; "colour:red", "colour:#ff8000" carry there
  odd            a region of a bundled object: the bracelet has odd and even
"""
EPILOG = """\
examples:
  retouch wrap gravel-tile starfish -o starfish.3mf
  retouch wrap gravel-tile part.stl --mask "z>2 & angle<80" --size-mm 8 -o part.3mf
  retouch wrap gravel-tile bracelet --region odd=+2 -o bracelet.3mf
  retouch wrap gravel-tile frog --preview frog.html
  retouch wrap bark-tile handle.stl --along z -o handle.3mf
  retouch wrap logo.png part.stl --at 0,0,20 --size-mm 12 --relief-mm 0.6 -o part.3mf
  retouch wrap leather-tile grip.obj --units in --relief-mm 0.4 --level 0.5 -o grip.glb
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("texture", type=Path, metavar="TEXTURE", help=f"a tile: {TEXTURE}; or a run's folder")
    parser.add_argument(
        "mesh", type=Path, metavar="MESH", help="file of a solid, or the name of an object that comes along"
    )
    parser.add_argument(
        "-o", dest="out", type=Path, metavar="OUT", help=f"file to write: {', '.join(FORMATS)}"
    )
    parser.add_argument(
        "--preview",
        type=Path,
        metavar="PAGE",
        help="page (.html) that shows in seconds what will come out, with size, triangles and time; without "
        "-o nothing else is made",
    )
    add_plate(parser, side="width of one tile")
    parser.add_argument(
        "--units", choices=tuple(UNITS), help="unit of the mesh (default: the file's, else mm)"
    )
    parser.add_argument(
        "--unite",
        action="store_true",
        help="make parts one that overlap, lie within others or lie there twice",
    )
    parser.add_argument(
        "--close-holes",
        dest="close_holes_mm",
        type=float,
        metavar="MM",
        help="size up to which holes in an open mesh are closed (default: 0.5)",
    )
    where = parser.add_argument_group("where and how")
    where.add_argument(
        "--mask", metavar="MASK", help="part of the surface that carries texture (default: all)"
    )
    where.add_argument(
        "--region",
        action="append",
        default=[],
        metavar="MASK=TEXTURE",
        help="another texture where the mask is; or the change of feel in just-noticeable differences, as in "
        "odd=+2, for which the texture is optimised; may be given several times, later ones lie on top",
    )
    where.add_argument(
        "--falloff-mm", type=float, metavar="MM", help="width over which textures end, mm (default: 2)"
    )
    where.add_argument(
        "--level",
        type=float,
        default=0.0,
        help="height of the object's own surface in the relief: 0, the relief stands on it (default), to 1, "
        "the relief is cut into it",
    )
    where.add_argument(
        "--no-bottom", dest="keep_bottom", action="store_false", help="texture a flat bottom too"
    )
    where.add_argument(
        "--keep-holes",
        dest="keep_holes_mm",
        type=float,
        metavar="MM",
        help="leave round holes up to this diameter without texture, through and blind ones: texture narrows "
        "a hole, so that shafts and screws no longer fit",
    )
    _add_placing(parser.add_argument_group("direction and place"))
    add_printer(
        where,
        "triangles no finer than this printer shows, and what it makes of the object in layers across z",
    )
    fine = where.add_mutually_exclusive_group()
    fine.add_argument(
        "--edge-mm",
        type=float,
        metavar="MM",
        help="longest edge of the triangles (default: what --faces allow, or that of the texture's samples)",
    )
    fine.add_argument(
        "--faces",
        type=int,
        metavar="N",
        help="triangles at most, about (default: as many as the feel needs, 1000000 at most)",
    )
    add_talk(parser, "file, size and what was done")


def _add_placing(group: argparse._ArgumentGroup) -> None:
    """Add the options of `relief.solids.wrapping.placement.placement_of`."""
    group.add_argument(
        "--projection",
        choices=PROJECTIONS,
        help="what flattens the surface: a shape, the mesh's texture coordinates, or patches (default: auto, "
        "the coordinates or a cylinder where they keep sizes, else patches)",
    )
    group.add_argument(
        "--along",
        metavar="AXIS",
        help="where the top of the texture points: x, y, z, -x, -y, -z or a direction as 1,1,0; of a "
        "cylinder and a sphere also the axis (default: the axis that is found)",
    )
    group.add_argument(
        "--turn",
        dest="turn_deg",
        type=float,
        metavar="DEGREES",
        help="turn the texture in the surface, counter-clockwise seen from outside",
    )
    group.add_argument(
        "--offset",
        dest="offset_mm",
        metavar="MM",
        help="move the texture in the surface: to its right, or as 2.5,-1 to its right and to its top",
    )
    group.add_argument(
        "--at",
        metavar="X,Y,Z|middle",
        help="place the texture once, around this point of the surface, mm, or in the middle of the mask, "
        "without one at the top (default: textures repeat; one whose sides do not fit lies in the middle)",
    )


def run(arguments: argparse.Namespace) -> int:
    if arguments.out is None and arguments.preview is None:
        raise InputError("-o: missing; or --preview for a page alone")
    options = {
        "regions": [_region(text) for text in arguments.region],
        **given(arguments, "units", *LENGTHS),
        **given(arguments, "mask", "level", "falloff_mm", "keep_bottom", "edge_mm", "faces"),
        **given(arguments, *PLACING),
        **given(arguments, "unite", "close_holes_mm", "keep_holes_mm", "printer"),
    }
    told: dict[str, Any] = {}
    lines: list[str] = []
    if arguments.preview is not None:
        previewed = retouch.preview_wrap(arguments.texture, arguments.mesh, arguments.preview, **options)
        told = previewed.as_json()
        lines = [_preview_line(told)]
    if arguments.out is not None:
        if lines and not (arguments.json or arguments.quiet):
            print(lines.pop(), flush=True)
        wrapped = retouch.wrap(arguments.texture, arguments.mesh, arguments.out, **options)
        numbers = wrapped.as_json()
        lines = _lines(numbers)
        told = numbers | ({"preview": told["preview"]} if told else {})
    if arguments.json:
        print_json(told)
    elif not arguments.quiet:
        for line in lines:
            print(line)
    return 0


def _preview_line(told: Mapping[str, Any]) -> str:
    """What is told of a preview, for a person."""
    size = " x ".join(f"{side:.4g}" for side in told["size_mm"])
    time, unit = about(told["seconds"])
    return (
        f"{told['preview']}: {size} mm on {told['shown_faces']:,} triangles; retouch wrap will make about "
        f"{round(told['faces'], -4):,}, {told['bytes'] / 2**20:.2g} MiB as 3MF, in about {time} {unit}."
    )


def _region(text: str) -> tuple[str, Path | float]:
    """The mask, and the texture of `--region` or the change of its feel in JND. Raises InputError."""
    mask, equals, texture = (part.strip() for part in text.rpartition("="))
    if not (equals and mask and texture):
        raise InputError(f"--region: {text!r}: expected MASK=TEXTURE, as in odd=grass-tile, or odd=+2")
    if texture[0] in "+-":
        try:
            return mask, float(texture)
        except ValueError:
            pass
    return mask, Path(texture)


def _coordinates(told: Mapping[str, Any]) -> str:
    """What flattens the surface, in words."""
    kind, count = told["coordinates"], told["patches"]
    if kind == "patches":
        return "one patch" if count == 1 else f"{count} patches"
    return str(kind) if kind == "texture coordinates" else f"a {kind}"


def _lines(told: Mapping[str, Any]) -> list[str]:
    """What is told of a wrapped object, for a person."""
    size = " x ".join(f"{side:.4g}" for side in told["size_mm"])
    lines = [
        f"{told['file']}: {size} mm, {told['faces']:,} triangles, closed, {told['bytes'] / 2**20:.1f} MiB",
        f"Texture on {told['area_mm2']:.0f} mm² with edges of {told['edge_mm']:.2g} mm, by "
        f"{_coordinates(told)}; seams are blended on {100 * told['blended']:.0f} % of it.",
        *(f"{note[0].upper()}{note[1:]}." for note in told["notes"]),
    ]
    if told["off_size"] >= LEAST_TOLD:
        lines.append(
            f"On {100 * told['off_size']:.0f} % of it lengths in the texture are off by more than 10 %, by "
            f"up to {100 * told['stretch']:.0f} %."
        )
    if told["lowered"] > 0.0:
        lines.append(_lowered_line(told))
    lines += [
        f"{one['mask']}: {one['reached']:+.2f} JND on the object's curvature, asked for {one['jnd']:+g}; the "
        f"tile is that of {one['run']}."
        for one in told["steered"]
    ]
    if bends := _bending_line(told):
        lines.append(bends)
    if told["print"] is not None:
        lines.append(f"As printed by {told['print']['printer']}: {print_words(told['print'])}")
    return lines


def _bending_line(told: Mapping[str, Any]) -> str | None:
    """By which radii the object bends along the texture, and how a tile is steered for them, for a person."""
    radii = {name: told[name] for name in CURVED if told[name] is not None}
    if not radii:
        return None
    options = " ".join(f"--{name.replace('_', '-')} {radius:.3g}" for name, radius in radii.items())
    return f"In the median the object bends as a tile is steered for by retouch optimize {options}."


def _lowered_line(told: Mapping[str, Any]) -> str:
    """On what part of the texture the relief is lowered, how far and where, for a person."""
    line = (
        f"On {100 * told['lowered']:.1f} % the relief is lowered, to {told['median_factor']:.2f} of its "
        f"height in the median and {told['lowest_factor']:.2f} at least, where the object bends too tightly "
        "or is too thin"
    )
    if places := told["lowered_places"]:
        largest = places[0]
        at = ", ".join(f"{value:.1f}" for value in largest["at_mm"])
        line += f"; the largest such place, {largest['area_mm2']:.3g} mm², is around ({at}) mm"
    return line + "."
