"""`retouch prepare`: make a height map of any picture.

Makes a height map of a picture: square, grey, white is high. The picture may be a photograph, a scan or a
drawing of any sides: PNG, JPEG, TIFF, WebP, BMP, GIF or PGM; or numbers: TIFF, EXR, NPY, text, a measured
surface. Every step is reported. Beside the height map lies a preview, NAME-preview.png, with the picture, the
relief under raking light and the numbers. Earlier files of these names are replaced.

A photograph knows brightness, not height: bright is taken as high, dark with --invert.

examples:
  retouch prepare stone.jpg -o stone.png --relief-mm 1.2
  retouch prepare wall.jpg -o wall.png --relief-mm 0.8 --crop 400,200,1500,1500 --invert
  retouch prepare weave.tif -o weave.exr --relief-mm 0.5 --tile
  retouch prepare weave.exr -o large.exr --plate-mm 25
  retouch prepare heights.png -o heights-100.png --levels 0,255 --samples 100
  retouch prepare scan.tif -o scan.exr --units um --level --fill
"""

import argparse
from dataclasses import replace
from math import atan, degrees, radians, tan
from pathlib import Path
from typing import TYPE_CHECKING

import retouch
from mitsuba_scenes import find_texture
from relief.ground.errors import InputError
from relief.ground.files import check_file_to_write
from relief.ground.formats import PREVIEW
from relief.ground.formatting import number
from relief.ground.options import add_options, declared, given
from relief.ground.progress import stage
from relief.preparing.choices import PrepareOptions, check_output
from retouch.commands import options
from tactile.quantities import QUANTITIES, ROUGHNESS
from tactile.touch_limits import MAX_SAMPLES

if TYPE_CHECKING:
    from retouch import Evaluation, Prepared

NATURAL_ROUGHNESS = (0.03, 0.12)
"""Least and greatest roughness of natural surfaces, no unit (docs/explanation/finger.md)."""
HIGH_MM = 2.0
"""Relief, mm, at which every bundled texture of 10 mm is natural: what is smoother has too fine features."""

STEEP_DEG = 60.0
"""Median slope, degrees, above which no higher relief is advised: its bumps would be needles."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    options.add(parser, "picture PICTURE", "any picture; a bundled texture goes by its name", type=Path)
    options.add_out(parser, "OUT", "16-bit PNG, or EXR, which holds mm", required=True)
    add_options(parser, PrepareOptions)
    options.add_talk(parser, "the numbers", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    arguments.picture = find_texture(arguments.picture)
    out: Path = arguments.out
    check_file_to_write(out)
    shown = out.with_name(f"{out.stem}{PREVIEW}")
    for path in (out, shown):
        if path.exists() and arguments.picture.exists() and path.samefile(arguments.picture):
            raise InputError(f"{path}: -o: is the picture, or its preview would be; choose another name")
    check_output(out)
    prepared = retouch.prepare(arguments.picture, **given(arguments, *declared(PrepareOptions)))
    felt = None
    # The height map is written even if nobody knows how it feels, such as one smaller than the finger needs.
    try:
        felt = _felt(prepared, arguments.picture)
        feel = {} if arguments.json else _feel(prepared, felt)
    except InputError as error:
        feel = {"feel": f"not pressed: {error.for_command}"}
    prepared.save(out)
    retouch.save_preview(prepared, shown, felt)
    files = {"picture_file": str(arguments.picture), "heights": str(out), "preview": str(shown)}
    lines = dict(prepared.done) | feel
    bits = "16 bits" if out.suffix.lower() == ".png" else "mm"
    lines["written"] = f"{out} ({bits}), {shown}"
    if prepared.repeats:
        says = "is a tile" if prepared.repeats is True else f"repeats along {prepared.repeats}"
        lines["repeats"] = f"{out.name} says that it {says}; --no-repeats takes it as a plate"
    document = {**files, **prepared.numbers, **(felt.numbers if felt else {})}
    return options.report(arguments, document, lines.items())


def _felt(prepared: "Prepared", picture: Path) -> "Evaluation | None":
    """What a finger feels all over the plate or the tile, by the elastic layer.

    None if no relief is known, or it is too finely sampled to be pressed.
    """
    # Imported here, because the help needs no numpy.
    from relief.places import patch_shape

    relief = prepared.relief
    if relief is None or patch_shape(relief.surface)[0] > MAX_SAMPLES:
        return None
    with options.contact_errors_name(picture), stage("pressing the skin on the relief"):
        return retouch.evaluate(relief, skin=retouch.Skin())


def _feel(prepared: "Prepared", felt: "Evaluation | None") -> dict[str, str]:
    """How the relief feels, or why nobody knows, and what to do about a relief that is far from natural."""
    if felt is None:
        if prepared.relief_mm is None:
            return {"feel": "unknown without --relief-mm"}
        return {"feel": f"not pressed: more than {MAX_SAMPLES} samples a side of what is under a finger"}
    touch, roughness = felt.touch, felt.roughness
    numbers = [f"{one.label} {number(touch.means[name])} {one.unit}" for name, one in QUANTITIES.items()]
    numbers.append(f"{100.0 * touch.contact_fraction:.0f} % of the patch in contact")
    if (ends := touch.ends)["count"] > 1:
        least, largest = (number(ends[f"{ROUGHNESS.name}_{end}"]) for end in ("min", "max"))
        numbers.append(f"means over {ends['count']} places of the finger, roughness {least} to {largest}")
    lines = {"feel": ", ".join(text.rstrip() for text in numbers)}
    lowest, highest = NATURAL_ROUGHNESS
    usual = f"than natural surfaces ({lowest:g} to {highest:g})"
    if roughness > highest:
        lines[""] = f"rougher {usual}; a lower --relief-mm helps"
    elif roughness < lowest:
        lines[""] = f"smoother {usual}; {_how_to_be_rougher(prepared, felt)}"
    return lines


def _how_to_be_rougher(prepared: "Prepared", felt: "Evaluation") -> str:
    """What makes a smooth relief natural: a higher one, unless its features are too fine for the finger."""
    relief, relief_mm = prepared.relief, prepared.relief_mm
    assert relief is not None and relief_mm is not None and prepared.relief_mm is not None
    touch = felt.touch
    if relief_mm < HIGH_MM:
        higher = replace(relief, heights=relief.heights * (HIGH_MM / relief_mm))
        # Imported here: torch, which presses, takes long to load.
        from tactile.measures import measure_touch

        with options.contact_errors_name(relief.name), stage("pressing the skin on a higher relief"):
            touch, relief_mm = measure_touch(higher, retouch.Skin(), "layer"), HIGH_MM
    roughness = touch.means[ROUGHNESS.name]
    at_most = f"roughness {number(roughness)} at {relief_mm:g} mm"
    rise = tan(radians(prepared.numbers["slopes_deg"]["median"])) * relief_mm / prepared.relief_mm
    slope = degrees(atan(rise))
    if steep := slope > STEEP_DEG:
        at_most += f", where half of the slopes are above {slope:.0f}°"
    # A finger that rests on the tops alone gains little by higher tops; one that follows gains in proportion.
    if not steep and (roughness >= NATURAL_ROUGHNESS[0] or touch.contact_fraction > 0.5):
        return f"a higher --relief-mm helps ({at_most})"
    # Of a picture whose size is known, a part keeps its scale.
    part = "" if "size_mm" in prepared.picture.lengths else "--crop or --centre a smaller part, or "
    return (
        f"features are too fine for the finger ({at_most}): {part}take a larger --size-mm, so that bumps are "
        "1 to 3 mm apart"
    )
