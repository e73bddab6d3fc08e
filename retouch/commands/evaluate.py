"""`retouch evaluate`: roughness and contact area of textures and print files, and how far a change can go."""

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from mitsuba_scenes import find_file, find_texture
from mitsuba_scenes.fingers import DEFAULT_SKIN
from relief.common.errors import InputError, naming
from relief.common.formats import MESHES
from relief.common.formatting import number
from relief.common.limits import PATCH_SIDE_MM
from relief.common.progress import stage
from relief.printers import PRINTERS
from relief.relief import Relief
from retouch.commands.mesh_entries import (
    MOST_PLACES,
    add_meshes,
    check_mesh_options,
    feel_mesh,
    is_mesh,
    mesh_lines,
    more_of_mesh,
    read_meshes,
)
from retouch.commands.options import (
    SCENE,
    TEXTURE,
    add_mitsuba,
    add_plate,
    add_printer,
    add_repeats,
    add_skin,
    add_talk,
    check_scales,
    console,
    contact_errors_name,
    print_json,
)
from retouch.commands.touch_entries import described, table
from tactile.model_names import MODEL_NAMES, model_name
from tactile.quantities import LARGEST_JND, LIMIT_PERCENT
from tactile.skin import Skin

if TYPE_CHECKING:
    from optimize.verification.mesh_feel import MeshFeel
    from relief.relief import Relief
    from relief.surface import Surface
    from tactile.measures import TouchMeasures
    from tactile.model import ModelName

SKIN = {
    "force_n": ("N", "force of the finger, N"),
    "young_modulus_mpa": ("MPA", "Young's modulus, MPa"),
    "poisson_ratio": ("NU", "Poisson's ratio, no unit, from 0 to 0.499"),
    "thickness_mm": ("MM", "thickness of the soft skin over the bone, mm"),
    "depth_mm": ("MM", "depth of the receptors below the surface of the skin, mm"),
}
"""Attributes of the skin that have an option, with what the help calls the number and says of it."""

HELP = "measure how rough and how cold textures feel"
DESCRIPTION = f"""\
Presses the finger's skin on each texture and prints its roughness (no unit; full sum, double precision), its
contact area in mm² (more feels colder) and the share of the plate in contact. For several textures it also
prints how many just-noticeable differences each is rougher (+) or smoother (-) than the first.

With --reach it also estimates how much rougher and smoother `retouch optimize` can make each texture before
its pictures in the scene change by 2 % of white, the limit of the paper; on the bundled textures the change
comes out within a tenth of that of whole runs. That takes about ten seconds for 128 x 128 samples in the
studio, and minutes where the fast look cannot show the scene. Without --reach nothing is rendered.

A print file ({", ".join(MESHES)}) must be a solid. Fingers press on it at
most {MOST_PLACES} times, 2.5 mm apart, along the outward axis of each place; the flat side that lies on the
printer's bed is left out. Roughness is the mean over the places whose 10 mm patch reaches over no edge. The
object's own curvature is part of it unless --object names the object without texture.
"""
EPILOG = """\
examples:
  retouch evaluate stone.png --relief-mm 1.2
  retouch evaluate stone.exr runs/stone/heights.exr
  retouch evaluate stone.png --relief-mm 1.2 --reach
  retouch evaluate *.exr --force-n 2 --json
  retouch evaluate part.stl
  retouch evaluate knob.3mf --object plain-knob.3mf
  retouch evaluate part.stl --units in --json -o colours
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "textures",
        nargs="+",
        type=Path,
        metavar="TEXTURE",
        help=f"{TEXTURE}; or a print file ({', '.join(MESHES)})",
    )
    add_plate(parser)
    add_repeats(parser)
    add_printer(parser, "press on the texture as this printer makes it")
    parser.add_argument(
        "--model",
        choices=tuple(MODEL_NAMES),
        default="layer",
        help="model of touch: layer (elastic layer, default), quick (its solver stopped after a few steps), "
        "net (quick with a learned net), fem (finite elements)",
    )
    skin = parser.add_argument_group("the skin")
    add_skin(skin)
    for name, (metavar, quantity) in SKIN.items():
        flag, text = f"--{name.replace('_', '-')}", f"{quantity} (default: the skin's)"
        skin.add_argument(flag, type=float, metavar=metavar, help=text)
    add_meshes(parser)
    far = parser.add_argument_group("how far it goes")
    far.add_argument("--reach", action="store_true", help="estimate how many JND each way are possible")
    far.add_argument(
        "--scene",
        type=Path,
        help=f"Mitsuba scene (.xml) for --reach; a bundled one by its name (default: {SCENE})",
    )
    add_mitsuba(far)
    add_talk(parser, "a list with an entry for each texture", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    from optimize.settings.skins import described_skin
    from relief.common.lengths import RANGES

    arguments.textures = [find_texture(texture) for texture in arguments.textures]
    textures = [texture for texture in arguments.textures if not is_mesh(texture)]
    check_mesh_options(arguments, textures)
    check_scales(arguments, textures)
    scene = _scene(arguments)
    name, skin = _skin(arguments)
    # All files are read before the first press, so that a misspelt name is refused at once.
    lengths = {key: getattr(arguments, key) for key in RANGES}
    printer = None if arguments.printer is None else PRINTERS[arguments.printer]
    repeats = arguments.repeats or False
    reliefs = {
        texture: Relief.read(texture, **lengths, repeats=repeats, printer=printer) for texture in textures
    }
    meshes = read_meshes(arguments)
    bare = meshes.get(arguments.object)
    measured: list[TouchMeasures | MeshFeel] = []
    with stage("evaluating", len(arguments.textures)) as advance:
        for texture in arguments.textures:
            if texture in meshes:
                measured.append(feel_mesh(meshes[texture], skin, arguments.model, bare))
            else:
                measured.append(measure(reliefs[texture], skin, arguments.model))
            advance()
    entries = described(arguments.textures, measured)
    for texture, entry, touch in zip(arguments.textures, entries, measured, strict=True):
        if scene is not None:
            entry["reach"] = reached(texture, scene, skin, arguments)
        if texture in meshes:
            entry |= more_of_mesh(meshes[texture], cast("MeshFeel", touch), arguments.out, Path(name).stem)
    if arguments.json:
        setting = {"skin": described_skin(skin, name), "model": arguments.model, "printer": arguments.printer}
        for texture, entry in zip(arguments.textures, entries, strict=True):
            entry |= ({} if texture in meshes else {"size_mm": reliefs[texture].width_mm}) | setting
        print_json(entries)
        return 0
    screen = console()
    screen.print(table(entries))
    pressed = [patch_mm(relief.surface) for relief in reliefs.values()]
    pressed += [PATCH_SIDE_MM] * bool(meshes)
    patches = " and ".join(f"{side:.4g} x {side:.4g}" for side in dict.fromkeys(pressed))
    by = f", as printed by {arguments.printer}" if arguments.printer else ""
    screen.print(
        f"{model_name(arguments.model).capitalize()}, skin {Path(name).stem}: {_moduli(skin)}, "
        f"Poisson's ratio {skin.poisson_ratio:g}, {skin.force_n:g} N on {patches} mm{by}."
    )
    if scene is not None:
        limit = f"before its pictures in {scene.stem} change by {LIMIT_PERCENT:g} % of white"
        for entry in entries:
            ways = _ways(entry["reach"])
            screen.print(f"{entry['texture']} can be made {ways} {limit}.", markup=False)
    for line in mesh_lines(entries):
        screen.print(line, markup=False)
    return 0


def patch_mm(surface: "Surface") -> float:
    """Side of the square that the finger presses on, mm."""
    from relief.patches import Patches
    from relief.places import places

    return Patches(surface, places(surface)).size_mm


def _skin(arguments: argparse.Namespace) -> tuple[str, Skin]:
    """Name and values of the skin that the options describe. Raises InputError."""
    from optimize.settings.skins import OWN, load_skin

    name = arguments.skin or DEFAULT_SKIN
    named = load_skin(name)
    given = {key: getattr(arguments, key) for key in SKIN if getattr(arguments, key) is not None}
    with naming("evaluate"):
        skin = replace(named, **given)
    return name if skin == named else OWN, skin


def _moduli(skin: Skin) -> str:
    """The layers of a skin from the surface down, and the modulus of the rest."""
    layers = "".join(f"{thickness:g} mm of {modulus:g} over " for thickness, modulus in skin.layers)
    return f"{layers}{skin.young_modulus_mpa:g} MPa"


def _scene(arguments: argparse.Namespace) -> Path | None:
    """The scene of --reach; None without. Raises InputError."""
    if arguments.reach:
        return find_file(arguments.scene or SCENE, ".xml")
    for flag, value in (("--scene", arguments.scene), ("-D", arguments.defines), ("-m", arguments.variant)):
        if value:
            raise InputError(f"{flag}: belongs to --reach; nothing else renders")
    return None


def reached(texture: Path, scene: Path, skin: Skin, arguments: argparse.Namespace) -> dict[str, Any]:
    """How much rougher and smoother a texture can be made in a scene; the entry `reach` of the JSON."""
    from optimize.estimates.reach import reach
    from visual.scene import load_scene
    from visual.scene_file.fitting import scene_relief

    with naming(texture), contact_errors_name(texture), stage(f"reach of {texture.name}"):
        relief = scene_relief(
            scene,
            dict(arguments.defines),
            texture,
            size_mm=arguments.size_mm,
            relief_mm=arguments.relief_mm,
            height_scale=arguments.height_scale,
            repeats=arguments.repeats or False,
        )
        loaded = load_scene(
            scene,
            dict(arguments.defines),
            arguments.variant,
            relief=relief,
        )
        return {"scene": str(scene), **reach(loaded, skin).as_json()}


def _ways(found: Mapping[str, Any]) -> str:
    """A reach in words."""
    ways = []
    for sense in ("rougher", "smoother"):
        way = found[sense]
        jnd = f"{number(way['jnd'], 2)} JND"
        beyond = way["jnd"] >= LARGEST_JND or not way["arrived"]
        ways.append(f"{jnd} or more {sense}" if beyond else f"about {jnd} {sense}")
    return " or ".join(ways)


def measure(relief: "Relief", skin: Skin, model: "ModelName") -> "TouchMeasures":
    """Press the skin on a texture, at every place of a tile or of a plate larger than a finger.

    Raises:
        InputError: unfit heights, size or model, or a contact that does not converge; the line has the name.
    """
    from tactile.measures import measure_touch

    with naming(relief.name), contact_errors_name(relief.name):
        return measure_touch(relief, skin, model)
