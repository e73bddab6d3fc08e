"""`retouch wrap`: a tile on an object, with the same size in mm everywhere."""

import argparse
import dataclasses
import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mitsuba_scenes import find_texture
from relief.common.errors import InputError, naming
from relief.common.formats import FORMATS
from retouch.commands.options import TEXTURE, add_plate, add_talk, check_scales, print_json

if TYPE_CHECKING:
    from relief.body import Body
    from relief.common.arrays import Array
    from relief.wrapping.masks import Regions
    from relief.wrapping.wrap import Covering, Wrapped

_log = logging.getLogger(__name__)

OBJECTS = "starfish, bracelet, slider, frog, curved, ball, cylinder"
"""Names of the bundled objects, as the help lists them."""
UNITS = ("um", "mm", "cm", "m", "in", "ft")
"""Units of length of a mesh."""

HELP = "lay a tile over an object"
DESCRIPTION = f"""\
Displaces the surface of a mesh by a texture that repeats, along the normals, with the same size in mm
everywhere: by the mesh's texture coordinates where they keep sizes, else by flat patches that are turned to
fit one another and blended where they cannot. A solid comes out as a solid; a flat bottom stays flat.

meshes: STL, OBJ, PLY, GLB, 3MF, or an object that comes with Retouch by its name:
  {OBJECTS}

masks, several joined by &:
  "z>2"          above z = 2 mm; the texture grows over the falloff, "z>2..5" from z = 2 to z = 5; x and y too
  "angle<60"     normals within 60 degrees of +z; "angle:-x<30" within 30 degrees of -x
  "turn>90"      angle about z through the middle of the object, degrees from +x
  mask.png       a picture over the mesh's texture coordinates, white carries the texture
  odd            a region of a bundled object: the bracelet has odd and even
"""
EPILOG = """\
examples:
  retouch wrap gravel-tile starfish -o starfish.3mf
  retouch wrap gravel-tile part.stl --mask "z>2 & angle<80" --size-mm 8 -o part.3mf
  retouch wrap gravel-tile bracelet --region odd=runs/rougher -o bracelet.3mf
  retouch wrap leather-tile grip.obj --units in --relief-mm 0.4 --level 0.5 -o grip.glb
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("texture", type=Path, metavar="TEXTURE", help=f"a tile: {TEXTURE}; or a run's folder")
    parser.add_argument(
        "mesh", type=Path, metavar="MESH", help="file of a solid, or the name of an object that comes along"
    )
    parser.add_argument(
        "-o", dest="out", type=Path, required=True, metavar="OUT", help=f"file to write: {', '.join(FORMATS)}"
    )
    add_plate(parser, side="width of one tile")
    parser.add_argument("--units", choices=UNITS, help="unit of the mesh (default: the file's, else mm)")
    where = parser.add_argument_group("where and how")
    where.add_argument(
        "--mask", metavar="MASK", help="part of the surface that carries texture (default: all)"
    )
    where.add_argument(
        "--region",
        action="append",
        default=[],
        metavar="MASK=TEXTURE",
        help="another texture where the mask is; may be given several times, later ones lie on top",
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
    fine = where.add_mutually_exclusive_group()
    fine.add_argument(
        "--edge-mm",
        type=float,
        metavar="MM",
        help="longest edge of the triangles (default: that of the texture's samples, or what --faces allow)",
    )
    fine.add_argument("--faces", type=int, metavar="N", help="triangles at most, about (default: 1000000)")
    add_talk(parser, "file, size and what was done")


def run(arguments: argparse.Namespace) -> int:
    from relief.body import Part
    from relief.export.parts import write_parts
    from relief.meshes.solid import check_solid
    from relief.wrapping.surfaces import Settings
    from relief.wrapping.wrap import wrap

    out = arguments.out
    if out.suffix.lower() not in FORMATS:
        raise InputError(f"{out}: -o: suffix {out.suffix!r} is not one of {', '.join(FORMATS)}")
    if not out.parent.is_dir():
        raise InputError(f"{out}: -o: there is no folder {out.parent}")
    if out.is_dir():
        raise InputError(f"{out}: -o: is a folder")
    coverings = _coverings(arguments)
    body, uv, regions = _object(arguments)
    given = {
        name: value
        for name in ("mask", "level", "falloff_mm", "keep_bottom", "edge_mm", "faces")
        if (value := getattr(arguments, name)) is not None
    }
    warnings = _misfits(coverings, body)
    for line in warnings:
        _log.warning("%s", line)
    with naming(arguments.mesh):
        wrapped = wrap(body, coverings, Settings(**given), uv, regions)
        check_solid(wrapped.body, "the wrapped object")
    try:
        write_parts(out, [Part(arguments.mesh.stem, wrapped.body)])
    except PermissionError as error:
        raise InputError(f"{out}: -o: {error.strerror}") from error
    told = described(wrapped)
    if arguments.json:
        print_json({"file": str(out), **told, "warnings": warnings, "bytes": out.stat().st_size})
    elif not arguments.quiet:
        for line in _lines(out, told):
            print(line)
    return 0


def _coverings(arguments: argparse.Namespace) -> "list[Covering]":
    """The textures and where they lie. Raises InputError."""
    from relief.common.lengths import RANGES
    from relief.heightmap import load_height_map
    from relief.seam import check_seams
    from relief.wrapping.tiles import Tile
    from relief.wrapping.wrap import Covering

    textures: list[tuple[Path, str | None]] = [(find_texture(arguments.texture), None)]
    for text in arguments.region:
        mask, equals, texture = text.rpartition("=")
        if not (equals and mask.strip() and texture.strip()):
            raise InputError(f"--region: {text!r}: expected MASK=TEXTURE, as in odd=grass-tile")
        textures.append((find_texture(Path(texture.strip())), mask))
    check_scales(arguments, [path for path, _ in textures])
    coverings = []
    for path, mask in textures:
        read = load_height_map(path, **{key: getattr(arguments, key) for key in RANGES})
        check_seams(read.heights, (True, True), path)
        coverings.append(Covering(Tile(read.heights, read.side_mm / read.heights.shape[1]), mask))
    return coverings


def _object(arguments: argparse.Namespace) -> "tuple[Body, Array | None, Regions]":
    """The body, its texture coordinates, and its regions. Raises InputError."""
    from relief.meshes.mesh import read_mesh
    from relief.meshes.solid import check_solid
    from relief.objects.table import OBJECTS

    path = arguments.mesh
    if not path.exists() and (thing := OBJECTS.get(str(path))):
        if arguments.units is not None:
            raise InputError(f"--units: {path} comes with Retouch, in mm")
        return thing.make(), None, thing.regions
    if not path.exists() and not path.suffix:
        raise InputError(f"{path}: no such file; objects that come with Retouch are {', '.join(OBJECTS)}")
    mesh = read_mesh(path, units=arguments.units)
    for line in mesh.warnings:
        _log.warning("%s: %s", path, line)
    check_solid(mesh.body, path)
    return mesh.body, mesh.uv, {}


def _misfits(coverings: "list[Covering]", body: "Body") -> list[str]:
    """Lines about tiles that are larger than the object."""
    import numpy as np

    longest = float(np.ptp(body.vertices, axis=0).max())
    return [
        f"a tile of {max(covering.tile.size_mm):.3g} mm is larger than the object, {longest:.3g} mm; "
        "--size-mm sets its size"
        for covering in coverings
        if max(covering.tile.size_mm) > longest
    ]


def described(wrapped: "Wrapped") -> dict[str, Any]:
    """What is told of a wrapped object, as JSON."""
    import numpy as np

    numbers = {
        field.name: getattr(wrapped, field.name)
        for field in dataclasses.fields(wrapped)
        if field.name not in ("body", "original", "textured")
    }
    return {
        "size_mm": np.ptp(wrapped.body.vertices, axis=0).tolist(),
        "faces": len(wrapped.body.faces),
        "self_intersections": 0,
        **numbers,
    }


def _lines(out: Path, told: dict[str, Any]) -> list[str]:
    """The same for a person."""
    size = " x ".join(f"{side:.4g}" for side in told["size_mm"])
    lines = [
        f"{out}: {size} mm, {told['faces']:,} triangles, closed, {out.stat().st_size / 2**20:.1f} MiB",
        f"Texture on {told['area_mm2']:.0f} mm² with edges of {told['edge_mm']:.2g} mm, by "
        + (f"{told['patches']} patches" if told["coordinates"] == "patches" else told["coordinates"])
        + f"; patches are blended on {100 * told['blended']:.0f} % of it.",
    ]
    if told["lowered"] > 0.0:
        lines.append(
            f"On {100 * told['lowered']:.1f} % the relief is lowered, to {told['lowest_factor']:.2f} of its "
            "height at least, where the object bends too tightly or is too thin."
        )
    return lines
