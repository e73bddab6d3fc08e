"""`retouch evaluate`: measure how rough and how cold textures feel.

Presses the finger's skin on each texture and prints its roughness (no unit; full sum, double precision), its
contact area in mm² (more feels colder) and the share of the patch in contact. For several textures it also
prints how many just-noticeable differences each is rougher (+) or smoother (-) than the first.

With --reach it also estimates how much rougher and smoother `retouch optimize` can make each texture before
its pictures in the scene change by 2 % of white, the limit of the paper; on the bundled textures the change
comes out within a tenth of that of whole runs. That takes about ten seconds for 128 x 128 samples in the
studio, and minutes where the fast look cannot show the scene. Without --reach nothing is rendered.

A print file ({FILES}) must be closed. Fingers press on it at most {MOST_MESH_PLACES} times, 2.5 mm apart,
along the outward axis of each place, after a look at up to {MOST_TRIED} places; the flat side that lies on
the printer's bed is left out. Roughness is the mean over the places whose 10 mm patch reaches over no edge,
and that of the texture alone: the object's own curvature is taken out, by --object, the object without
texture, or as estimated from each patch. A plate, with a flat back and upright sides, is felt as its height
map unless there is --object. Parts that pass through one another are felt from outside.

G-code (.gcode, .gcode.3mf, .bgcode) is felt as the beads that it lays, and by the sides of the part: top,
slope, side, overhang, bottom. Beads know nothing of sagging, oozing and the blobs of seams.

examples:
  retouch evaluate stone.png --relief-mm 1.2
  retouch evaluate stone.exr runs/stone/heights.exr
  retouch evaluate stone.png --relief-mm 1.2 --reach
  retouch evaluate *.exr --force-n 2 --json
  retouch evaluate stone.exr sand.exr --finger fingertip.stl --skin measured
  retouch evaluate part.stl
  retouch evaluate knob.3mf --object plain-knob.3mf
  retouch evaluate part.stl --units in --json -o colours
  retouch evaluate part.gcode --object part.stl --beside fuzzy.gcode
  retouch evaluate runs/gravel --slicer prusa-slicer --profile fine.ini
"""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import retouch
from mitsuba_scenes import DEFAULT_SCENE, find_file, find_texture
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.run_options import CURVED, curved_options
from relief.ground.errors import InputError, naming
from relief.ground.formats import MESHES, is_gcode, is_mesh, is_solid
from relief.ground.formatting import number
from relief.ground.limits import MOST_MESH_PLACES as MOST_MESH_PLACES
from relief.ground.limits import MOST_TRIED as MOST_TRIED
from relief.ground.options import add_option, given
from relief.ground.progress import stage
from relief.plate_options import fill_option, level_option
from relief.printers import find_printer
from relief.surface import Repeats, repeats_along
from retouch.commands import options
from tactile.quantities import GAPS_COUNT, QUANTITIES, ROUGHNESS
from tactile.touch_limits import model_name

if TYPE_CHECKING:
    from rich.table import Table

    from retouch import Evaluation, Scene, Skin

FILES = ", ".join(MESHES)
SKIN = {
    "force_n": ("N", "force of the finger, N"),
    "young_modulus_mpa": ("MPA", "Young's modulus, MPa"),
    "poisson_ratio": ("NU", "Poisson's ratio, no unit, from 0 to 0.499"),
    "thickness_mm": ("MM", "thickness of the soft skin over the bone, mm"),
    "depth_mm": ("MM", "depth of the receptors below the surface of the skin, mm"),
}
"""Attributes of the skin that have an option, with what the help calls the number and says of it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = f"{options.TEXTURE}; or a print file ({FILES}) or G-code"
    options.add(parser, "textures TEXTURE", text, nargs="+", type=Path)
    options.add_plate(parser)
    add_option(parser, "fill", fill_option(), bool)
    add_option(parser, "level", level_option(), bool)
    options.add_repeats(parser)
    options.add_printer(parser, "press on the texture as this printer makes it")
    options.add_model(parser)
    skin = parser.add_argument_group("the skin")
    options.add_skin(skin)
    for name, (metavar, quantity) in SKIN.items():
        options.add(skin, f"{_flag(name)} {metavar}", f"{quantity} (default: the skin's)", type=float)
    for name, option in curved_options("straight").items():
        add_option(skin, name, option, float)
    text = f"fingertip of one's own shape ({FILES}; --units states its unit), whose lower face "
    text += "touches and whose flat top is bonded to the bone: a check beside the round finger of its radii"
    options.add(skin, "--finger FILE", text, type=Path)
    _add_meshes(parser)
    _add_filament(parser)
    far = parser.add_argument_group("how far it goes")
    options.add(far, "--reach", "estimate how many JND each way are possible")
    text = f"Mitsuba scene (.xml) for --reach; a bundled one by its name (default: {DEFAULT_SCENE})"
    options.add(far, "--scene", text, type=Path)
    options.add_mitsuba(far)
    options.add(parser, "--readouts", "also print what other measures make of the same presses")
    options.add_talk(parser, "a list with an entry for each texture", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    arguments.textures = [find_texture(texture) for texture in arguments.textures]
    textures = [texture for texture in arguments.textures if not is_solid(texture)]
    _check_solid_options(arguments, textures)
    if arguments.finger is not None:
        if arguments.thickness_mm is not None:
            raise InputError("--thickness-mm: does not go with --finger, whose mesh has its own")
        # Height maps are in mm, and so keep their scale.
        arguments.height_scale = None if arguments.units else arguments.height_scale
    if not (arguments.units and len(textures) < len(arguments.textures)):
        options.check_scales(arguments, textures)
    scene = _scene(arguments)
    skin = _skin(arguments)
    # All files are read before the first press, so that a misspelt name is refused at once.
    printer = arguments.printer and find_printer(arguments.printer)
    chosen = given(arguments, "repeats", *options.LENGTHS, *options.CORRECTIONS)
    subjects: dict[Path, Any] = {
        texture: retouch.Relief.read(texture, printer=printer, **chosen) for texture in textures
    }
    for path in filter(is_mesh, arguments.textures):
        subjects[path] = retouch.read_solid(path, units=arguments.units)
    for path in filter(is_gcode, arguments.textures):
        subjects[path] = retouch.read_gcode(path)
    beside = arguments.beside and retouch.read_gcode(arguments.beside)
    bare = arguments.object and retouch.read_solid(arguments.object, units=arguments.units)
    finger = arguments.finger and retouch.read_solid(arguments.finger, units=arguments.units)
    evaluations: list[Evaluation] = []
    with stage("evaluating", len(arguments.textures)) as advance:
        for texture in arguments.textures:
            more = given(arguments, "slicer", "profile", "readouts") | {"finger": finger}
            if is_solid(texture):
                more = {"without_texture": bare, "colours": arguments.out}
            if is_mesh(texture):
                more |= {"on_shape": arguments.on_shape, "printer": printer}
            if is_gcode(texture):
                more |= {"beside": beside}
            with options.contact_errors_name(texture):
                subject = subjects[texture]
                if scene is not None:
                    more |= {"reach": _loaded(scene, texture, arguments, repeats_along(subject.repeats))}
                evaluations.append(retouch.evaluate(subject, model=arguments.model, skin=skin, **more))
            advance()
    if arguments.json:
        first = evaluations[0] if len(evaluations) > 1 else None
        options.print_json([one.as_json(first) for one in evaluations])
    else:
        several = [shown for one in evaluations for shown in (one, one.beside) if shown is not None]
        _print(several, arguments)
    return 0


def _print(evaluations: "list[Evaluation]", arguments: argparse.Namespace) -> None:
    """Print what is felt for a person."""
    screen = options.console()
    screen.print(table(evaluations))
    if (others := _readouts_table(evaluations)) is not None:
        screen.print(others)
        screen.print(_readouts_sources(), markup=False)
    # Of height maps first, as their sizes differ.
    pressed = [one.patch_mm for one in sorted(evaluations, key=lambda one: is_solid(Path(one.name)))]
    patches = " and ".join(f"{side:.4g} x {side:.4g}" for side in dict.fromkeys(pressed))
    by = f", as printed by {arguments.printer}" if arguments.printer else ""
    under = "the plate" if evaluations[0].skin.shape == "flat" else "the finger's patch"
    skin, skin_name = evaluations[0].skin, Path(evaluations[0].skin_name).stem
    model = model_name(evaluations[0].model).capitalize()
    if (own := evaluations[0].own) is not None:
        model += ", the round finger by the elastic layer"
    screen.print(
        f"{model}, skin {skin_name}: {_shape(skin)}{_moduli(skin)}, "
        f"Poisson's ratio {skin.poisson_ratio:g}, {skin.force_n:g} N on {patches} mm{by}.\n"
        f"{GAPS_COUNT[:1].upper()}{GAPS_COUNT[1:]}; in contact is the share of {under} under pressure."
    )
    if own is not None:
        screen.print(own.line, markup=False)
    for one in evaluations:
        for line in one.lines():
            screen.print(line, markup=False)
        if (bands := _bands_table(one)) is not None:
            screen.print(bands)


def _skin(arguments: argparse.Namespace) -> "Skin | str":
    """The skin that the options describe, or the name of one. Raises InputError."""
    name = DEFAULT_SKIN if arguments.skin is None else arguments.skin
    named = retouch.load_skin(name)
    with naming("evaluate"):
        skin = replace(named, **given(arguments, *SKIN, *CURVED))
    return name if skin == named else skin


def _shape(skin: "Skin") -> str:
    """The radii of a round finger, mm; nothing of a flat one."""
    if skin.radii_mm is None:
        return ""
    return f"round, radius {' x '.join(f'{radius:g}' for radius in dict.fromkeys(skin.radii_mm))} mm, "


def _moduli(skin: "Skin") -> str:
    """The layers of a skin from the surface down, and the modulus of the rest."""
    layers = "".join(f"{thickness:g} mm of {modulus:g} over " for thickness, modulus in skin.layers)
    return f"{layers}{skin.young_modulus_mpa:g} MPa"


def _scene(arguments: argparse.Namespace) -> Path | None:
    """The scene of --reach; None without. Raises InputError."""
    if arguments.reach:
        return find_file(arguments.scene or DEFAULT_SCENE, ".xml")
    for flag, value in (("--scene", arguments.scene), ("-D", arguments.defines), ("-m", arguments.variant)):
        if value:
            raise InputError(f"{flag}: belongs to --reach; nothing else renders")
    return None


def _loaded(scene: Path, texture: Path, arguments: argparse.Namespace, repeats: Repeats) -> "Scene":
    """The scene of --reach with a texture, as wide as its header or the scene says. Raises InputError."""
    defines = dict(arguments.defines)
    with naming(texture):
        lengths = given(arguments, *options.LENGTHS, *options.CORRECTIONS)
        relief = retouch.scene_relief(scene, defines, texture, **lengths, repeats=repeats)
        return retouch.load_scene(scene, defines, arguments.variant, relief=relief)


def _add_meshes(parser: argparse.ArgumentParser) -> None:
    """Add the options of print files."""
    group = parser.add_argument_group("print files")
    text = "the object without texture, a file or one that comes with Retouch: its curvature is taken out "
    text += "exactly, and else estimated from each patch"
    options.add(group, "--object FILE", text, type=Path)
    text = "press on the texture where it lies on the --object, and take out what the bare object strains: "
    text += "what a texture was steered for with --curved-x-mm"
    options.add(group, "--on-shape", text)
    text = "folder for the mesh in the colours of its roughness: NAME-roughness.html, a page, .glb and .png"
    options.add_out(group, "FOLDER", text)


def _add_filament(parser: argparse.ArgumentParser) -> None:
    """Add the options of G-code and of slicers."""
    group = parser.add_argument_group("filament")
    text = "G-code of another print of the same part, felt at the same places"
    options.add(group, "--beside GCODE", text, type=Path)
    text = "press on a height map as this slicer prints it, lying on the bed; of the result of a run, also "
    text += "what is left of its change (default with --profile: prusa-slicer)"
    options.add(group, "--slicer PROGRAM", text)
    options.add(group, "--profile FILE", "settings of the slicer, as it exports them (.ini)", type=Path)


def _check_solid_options(arguments: argparse.Namespace, textures: Sequence[Path]) -> None:
    """Raise InputError for options that do not fit the files: textures, print files, G-code or several."""
    gcode = sum(map(is_gcode, arguments.textures))
    solids = len(arguments.textures) - len(textures)
    meshes = solids - gcode
    print_files = f"print files ({FILES})"
    sliceable = not (solids or arguments.reach or arguments.readouts)
    repeats = "--no-repeats" if arguments.repeats is False else "--repeats"
    of_reliefs = "--reach", "--readouts", "--finger", repeats, *map(_flag, CURVED)
    lengths = map(_flag, (*options.LENGTHS, *options.CORRECTIONS))
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
        (("--slicer", "--profile"), sliceable, "is for height maps, without --reach and --readouts"),
        (lengths, textures, "is for height maps; --units states the unit of a print file"),
        (of_reliefs, not solids, "is for height maps; print files and G-code are felt as they are"),
    )
    stated = {_flag(name): value for name, value in vars(arguments).items()}
    stated |= {"-o": arguments.out, repeats: arguments.repeats is not None}
    # A unit sets the scale.
    stated |= {"--height-scale": None} if arguments.units else {}
    for flags, fits, words in rules:
        for flag in flags:
            if not fits and stated[flag] is not None and stated[flag] is not False:
                raise InputError(f"{flag}: {words}")
    if arguments.out is not None and arguments.out.exists() and not arguments.out.is_dir():
        raise InputError(f"{arguments.out}: -o: is no folder")


def _flag(name: str) -> str:
    """The option of an attribute."""
    return "--" + name.replace("_", "-")


def table(evaluations: "Sequence[Evaluation]") -> "Table":
    """A table for a person, one row a texture or solid."""
    several = len(evaluations) > 1
    spread = any(len(one.touch.values[ROUGHNESS.name]) > 1 for one in evaluations)
    headings = [*(quantity.label for quantity in QUANTITIES.values()), "in contact"]
    headings += ["JND from first"] * several
    columns = [("texture", "text"), *((heading, "number") for heading in headings)]
    # Folds in a narrow terminal, where names would else have no room.
    columns += [("over the places", "text")] * spread
    rows = []
    first = {"": evaluations[0], **evaluations[0].regions}
    for evaluation in evaluations:
        for region, one in {"": evaluation, **evaluation.regions}.items():
            means = one.touch.means
            values = [
                f"{number(means[key])} {quantity.unit}".rstrip() for key, quantity in QUANTITIES.items()
            ]
            apart = [_apart(one, first.get(region))] if several else []
            contact = f"{100.0 * one.contact_fraction:.0f} %"
            name = f"  {region}" if region else one.name
            rows.append([name, *values, contact, *apart, *([_spread(one)] if spread else [])])
    return options.table(columns, rows)


def _bands_table(evaluation: "Evaluation") -> "Table | None":
    """Waves of the skin's surface by region of a sliced part and by band, um rms; None of other surfaces."""
    if not (by_region := evaluation.bands):
        return None
    bands = next(iter(by_region.values()))
    columns = [("waves of the skin, µm rms", "text")]
    columns += [(f"{band.least_mm:g} to {band.most_mm:g} mm", "number") for band in bands]
    rows = [[name, *(number(band.initial_um, 2) for band in each)] for name, each in by_region.items()]
    rows.append(["detected on a smooth plate from", *(number(band.threshold_um, 2) for band in bands)])
    return options.table(columns, rows)


def _readouts_table(evaluations: "Sequence[Evaluation]") -> "Table | None":
    """Read-outs, a column a texture; None if they were not asked for."""
    if not evaluations[0].readouts:
        return None
    # Here, because torch comes with it, which help does not need.
    from tactile.readouts import READ_OUTS

    columns = [("read-out", "text"), *((Path(one.name).stem, "number") for one in evaluations)]
    rows = [
        [
            f"{out.label}, {out.unit}".rstrip(", "),
            *(f"{one.readouts[name]:.{out.decimals}f}" for one in evaluations),
        ]
        for name, out in READ_OUTS.items()
    ]
    return options.table(columns, rows)


def _readouts_sources() -> str:
    """A line for each source of read-outs, with the read-outs that it is of."""
    from tactile.readouts import READ_OUTS

    of = dict.fromkeys(out.source for out in READ_OUTS.values())
    labels = {source: [out.label for out in READ_OUTS.values() if out.source == source] for source in of}
    return "\n".join(f"{'; '.join(names)}: {source}" for source, names in labels.items())


def _apart(one: "Evaluation", first: "Evaluation | None") -> str:
    """Just-noticeable differences from another surface; empty if there is none of the kind."""
    if first is None:
        return ""
    jnd = one.jnd_from(first)
    return "smooth" if jnd is None else _jnd(jnd)


def _jnd(jnd: float) -> str:
    """Just-noticeable differences to a hundredth, which is far less than anybody feels."""
    return f"{round(jnd, 2) + 0.0:.2f}".replace("-", "\N{MINUS SIGN}")


def _spread(one: "Evaluation") -> str:
    """Number of the places, least and largest roughness."""
    values = one.touch.values[ROUGHNESS.name]
    if len(values) == 1:
        return "1 place"
    return f"{len(values)} places, {number(float(values.min()))} to {number(float(values.max()))}"
