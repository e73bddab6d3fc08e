"""`retouch prepare`: a height map made of any picture, and a preview of it."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import retouch
from mitsuba_scenes import find_texture
from relief.ground.errors import InputError
from relief.ground.files import check_file_to_write
from relief.ground.formats import PREVIEW
from relief.ground.formatting import number
from relief.ground.limits import LARGEST_SIDE, PATCH_SIDE_MM, SMALLEST_SIDE
from relief.ground.options import whole_number
from relief.ground.progress import stage
from relief.preparing.choices import AUTO, GREYS, METHODS, MOST_USUAL_SAMPLES, OUTPUTS, TURNS
from retouch.commands.options import (
    add_talk,
    console,
    contact_errors_name,
    lines_table,
    print_json,
)
from tactile.quantities import QUANTITIES, ROUGHNESS
from tactile.touch_limits import MAX_SAMPLES

if TYPE_CHECKING:
    from retouch import Evaluation, Prepared

NATURAL_ROUGHNESS = (0.03, 0.12)
"""Least and greatest roughness of natural surfaces, no unit (docs/touch.md)."""
HIGH_MM = 2.0
"""Relief, mm, at which every bundled texture of 10 mm is natural: what is smoother has too fine features."""

OPTIONS = (
    *("grey", "crop", "centre", "rotate", "samples", "invert", "levels", "keep_steps", "tile"),
    *("plate_mm", "relief_mm", "size_mm"),
)
"""Options that are arguments of `relief.preparing.picture_preparation.prepare`, by the same names."""

HELP = "make a height map of any picture"
DESCRIPTION = """\
Makes a height map of a picture: square, grey, white is high. The picture may be a photograph, a scan or a
drawing of any sides: PNG, JPEG, TIFF, WebP, BMP, GIF, PGM, EXR or NPY. Every step is reported. Beside the
height map lies a preview, NAME-preview.png, with the picture, the relief under raking light and the numbers.

A photograph knows brightness, not height: bright is taken as high, dark with --invert.
"""
EPILOG = """\
examples:
  retouch prepare stone.jpg -o stone.png --relief-mm 1.2
  retouch prepare wall.jpg -o wall.png --relief-mm 0.8 --crop 400,200,1500,1500 --invert
  retouch prepare weave.tif -o weave.exr --relief-mm 0.5 --tile
  retouch prepare weave.exr -o large.exr --plate-mm 25
  retouch prepare heights.png -o heights-100.png --levels 0,255 --samples 100
"""


def tile(text: str) -> str:
    """Read a way to make a height map periodic. Raises argparse.ArgumentTypeError."""
    if text not in (AUTO, *METHODS):
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not one of {', '.join((AUTO, *METHODS))}")
    return text


def crop(text: str) -> tuple[int, ...]:
    """Read "X,Y,W,H". Raises argparse.ArgumentTypeError."""
    parts = text.split(",")
    if len(parts) != 4:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not X,Y,W,H, four whole numbers of pixels")
    return tuple(whole_number(0, 10**6)(part.strip()) for part in parts)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "picture", type=Path, metavar="PICTURE", help="any picture; a bundled texture goes by its name"
    )
    parser.add_argument(
        "-o", dest="out", type=Path, required=True, metavar="OUT", help="16-bit PNG, or EXR, which holds mm"
    )
    parser.add_argument(
        "--relief-mm",
        type=float,
        metavar="MM",
        help="height of the highest point above the lowest, mm; written to OUT (default: unknown)",
    )
    parser.add_argument(
        "--size-mm",
        type=float,
        metavar="MM",
        help=f"side of the plate, mm; written to OUT (default: unknown, which counts as {PATCH_SIDE_MM:g})",
    )
    what = parser.add_argument_group("what is taken")
    what.add_argument(
        "--crop",
        type=crop,
        metavar="X,Y,W,H",
        help="the part W pixels wide and H high, X from the left and Y from the top (default: the picture); "
        "if it is not square, the square in its middle",
    )
    what.add_argument(
        "--centre",
        type=whole_number(1, 10**6),
        metavar="N",
        help="the square of N pixels a side in the middle (default: the largest)",
    )
    what.add_argument(
        "--rotate",
        type=int,
        choices=TURNS,
        default=0,
        metavar="DEGREES",
        help="turn the part anticlockwise by 90, 180 or 270 degrees (default: 0)",
    )
    what.add_argument(
        "--samples",
        type=whole_number(SMALLEST_SIDE, LARGEST_SIDE),
        metavar="N",
        help=f"samples a side (default: one a pixel, at most {MOST_USUAL_SAMPLES})",
    )
    what.add_argument(
        "--grey",
        choices=tuple(GREYS),
        default="luminance",
        help="what of a coloured picture is height (default: luminance)",
    )
    how = parser.add_argument_group("how it becomes height")
    how.add_argument("--invert", action="store_true", help="dark is high")
    how.add_argument(
        "--levels",
        metavar="LOW,HIGH",
        help="what becomes lowest and highest: grey from 0 to 255, or percentiles, as in 0.5%%,99.5%% "
        "(default: the darkest and the brightest sample)",
    )
    how.add_argument(
        "--keep-steps",
        action="store_true",
        help="keep the steps of 8-bit grey (default: smoothed by up to half a step)",
    )
    how.add_argument(
        "--tile",
        type=tile,
        nargs="?",
        const=AUTO,
        metavar="METHOD",
        help="make the height map periodic: blend (for stochastic textures), cut (for structured ones), or "
        "auto, the one with the smaller seam error (default with --tile: auto)",
    )
    how.add_argument(
        "--plate-mm",
        type=float,
        metavar="MM",
        help="repeat the tile over a plate of this side; --size-mm is that of the tile (default: one tile)",
    )
    add_talk(parser, "the numbers", quiet=False)


def run(arguments: argparse.Namespace) -> int:
    arguments.picture = find_texture(arguments.picture)
    out: Path = arguments.out
    check_file_to_write(out)
    shown = out.with_name(f"{out.stem}{PREVIEW}")
    for path in (out, shown):
        if path.exists() and arguments.picture.exists() and path.samefile(arguments.picture):
            raise InputError(f"{path}: -o: is the picture, or its preview would be; choose another name")
    if out.suffix.lower() not in OUTPUTS:
        raise InputError(f"{out}: a height map is written as {' or '.join(OUTPUTS)}")
    prepared = retouch.prepare(arguments.picture, **{name: getattr(arguments, name) for name in OPTIONS})
    felt = _felt(prepared, arguments.picture)
    feel = {} if arguments.json else _feel(prepared, felt)
    prepared.save(out)
    retouch.save_preview(prepared, shown, felt)
    if arguments.json:
        files = {"picture_file": str(arguments.picture), "heights": str(out), "preview": str(shown)}
        print_json({**files, **prepared.numbers, **(felt.numbers if felt else {})})
        return 0
    lines = dict(prepared.done) | feel
    bits = "16 bits" if out.suffix.lower() == ".png" else "mm"
    lines["written"] = f"{out} ({bits}), {shown}"
    if prepared.repeats:
        lines["repeats"] = f"{out.name} says that it is a tile; --no-repeats takes it as a plate"
    console().print(lines_table(lines.items()))
    return 0


def _felt(prepared: "Prepared", picture: Path) -> "Evaluation | None":
    """What a finger feels all over the plate or the tile, by the elastic layer.

    None if no relief is known, or it is too finely sampled to be pressed.
    """
    # Imported here, because the help needs no numpy.
    from relief.places import patch_shape

    relief = prepared.relief
    if relief is None or patch_shape(relief.surface)[0] > MAX_SAMPLES:
        return None
    with contact_errors_name(picture), stage("pressing the skin on the relief"):
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
    assert relief is not None and relief_mm is not None
    if relief_mm < HIGH_MM:
        higher = replace(relief, heights=relief.heights * (HIGH_MM / relief_mm))
        with contact_errors_name(relief.name), stage("pressing the skin on a higher relief"):
            felt, relief_mm = retouch.evaluate(higher, skin=retouch.Skin()), HIGH_MM
    at_most = f"roughness {number(felt.roughness)} at {relief_mm:g} mm"
    # A finger that rests on the tops alone gains little by higher tops; one that follows gains in proportion.
    if felt.roughness >= NATURAL_ROUGHNESS[0] or felt.contact_fraction > 0.5:
        return f"a higher --relief-mm helps ({at_most})"
    # Of a picture whose size is known, a part keeps its scale.
    part = "" if "size_mm" in prepared.picture.lengths else "--crop or --centre a smaller part, or "
    return f"features are too fine for the finger ({at_most}): {part}take a larger --size-mm"
