"""`retouch wrap`: lay a tile over an object.

Displaces the surface of a mesh by a texture that repeats, along the normals, with the same size in mm
everywhere: by the mesh's texture coordinates where they keep sizes, around a cylinder without a seam, else by
flat patches that are turned to fit one another and blended where they cannot. A texture whose sides do not
fit is placed once. A solid comes out as a solid; a flat bottom stays flat.

meshes: STL, OBJ, PLY, GLB, 3MF, STEP (extra step), or an object that comes with Retouch by its name:
  {OBJECT_NAMES}

masks, joined by & or |, with not and parentheses:
  "z>2"          above z = 2 mm; the texture grows over the falloff, "z>2..5" from z = 2 to z = 5; x and y too
  "angle<60"     normals within 60 degrees of +z; "angle:-x<30" within 30 degrees of -x
  outside        what sees more than half of its surroundings: of a cup the outer wall and the rim
  "turn>90"      angle about z through the middle of the object, degrees from +x
  mask.png       a picture over the mesh's texture coordinates, white carries the texture
  colour         colours of PLY, OBJ, GLB, STEP, 3MF: white carries; "colour:red", "colour:#ff8000": there
  odd            a region of a bundled object: the bracelet has odd and even

examples:
  retouch wrap gravel-tile starfish -o starfish.3mf
  retouch wrap gravel-tile part.stl --mask "z>2 & angle<80" --size-mm 8 -o part.3mf
  retouch wrap gravel-tile bracelet --region odd=+2 -o bracelet.3mf
  retouch wrap gravel-tile frog --preview frog.html
  retouch wrap bark-tile handle.stl --along z -o handle.3mf
  retouch wrap logo.png part.stl --at 0,0,20 --size-mm 12 --relief-mm 0.6 -o part.3mf
  retouch wrap leather-tile grip.obj --units in --relief-mm 0.4 --level 0.5 -o grip.glb
"""

import argparse
from pathlib import Path
from typing import Any

import retouch
from relief.ground.errors import InputError
from relief.ground.formats import FORMATS
from relief.ground.options import add_options, declared, given
from relief.solids.names import OBJECTS
from retouch.commands.options import TEXTURE, add, add_out, add_talk, print_json
from retouch.verbs.objects.wrap_options import WrapOptions

OBJECT_NAMES = ", ".join(OBJECTS)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add(parser, "texture TEXTURE", f"a tile: {TEXTURE}; or a run's folder", type=Path)
    add(parser, "mesh MESH", "file of a solid, or the name of an object that comes along", type=Path)
    add_out(parser, "OUT", f"file to write: {', '.join(FORMATS)}")
    text = "page (.html) that shows in seconds what will come out, with size, triangles and time; without "
    text += "-o nothing else is made"
    add(parser, "--preview PAGE", text, type=Path)
    add_options(parser, WrapOptions)
    add_talk(parser, "file, size and what was done")


def run(arguments: argparse.Namespace) -> int:
    if arguments.out is None and arguments.preview is None:
        raise InputError("-o: missing; or --preview for a page alone")
    options = given(arguments, *declared(WrapOptions))
    numbers: dict[str, Any] = {}
    if arguments.preview is not None:
        preview = retouch.preview_wrap(arguments.texture, arguments.mesh, arguments.preview, **options)
        numbers = preview.as_json()
        if not (arguments.json or arguments.quiet):
            print(preview.line(), flush=True)
    if arguments.out is not None:
        wrapped = retouch.wrap(arguments.texture, arguments.mesh, arguments.out, **options)
        numbers = wrapped.as_json() | {name: numbers[name] for name in ("preview",) if numbers}
        if not (arguments.json or arguments.quiet):
            print(*wrapped.lines(), sep="\n")
    if arguments.json:
        print_json(numbers)
    return 0
