"""`retouch compare`: two textures, results or runs side by side, on one page and on the screen."""

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import retouch
from mitsuba_scenes import find_texture
from relief.ground.errors import InputError
from relief.ground.files import check_file_to_write
from relief.ground.formatting import number, percent
from retouch.commands.options import (
    LENGTHS,
    TEXTURE,
    add_distance,
    add_mitsuba,
    add_plate,
    add_repeats,
    add_skin,
    add_talk,
    check_scales,
    console,
    contact_errors_name,
    count,
    given,
    lines_table,
    print_json,
    seed,
)
from retouch.commands.summary import jnd_in_words, measured_finger, other_fingers, told_apart
from tactile.quantities import GAPS_COUNT, QUANTITIES
from tactile.touch_limits import MODEL_NAMES

if TYPE_CHECKING:
    from optimize.verification.verification import PictureChange
    from retouch.pages.content import Compared

PAGE = Path("comparison.html")
"""File of the page where no other is given."""

HELP = "show two textures, results or runs side by side"
DESCRIPTION = f"""\
Presses the finger on both reliefs and renders both under the same lights. Writes one page that needs no
network: how each feels, how many just-noticeable differences apart the two are, both pictures over one
another to slide or blink between, the change of the pictures, DSSIM and FLIP, profiles, heights and strain.

A run directory stands for its result. One run directory alone: its original beside its result. Reliefs on
plates of two sizes are compared by touch alone.

TEXTURE: {TEXTURE}.
"""
EPILOG = """\
examples:
  retouch compare runs/stone
  retouch compare runs/stone runs/stone-2 -o both.html
  retouch compare gravel brick --relief-mm 1.2
  retouch compare stone.exr runs/stone --scene five_views --json
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("first", type=Path, metavar="A", help="TEXTURE or RUN_DIR")
    parser.add_argument(
        "second",
        type=Path,
        nargs="?",
        metavar="B",
        help="the same (default: the result of the run A)",
    )
    parser.add_argument(
        "-o", dest="out", type=Path, default=PAGE, metavar="PAGE", help=f"file to write (default: {PAGE})"
    )
    add_plate(parser)
    add_repeats(parser, "the run's")
    parser.add_argument(
        "--model",
        choices=tuple(MODEL_NAMES),
        default="layer",
        help="model of touch: layer (elastic layer, default), quick, net, fem (finite elements)",
    )
    add_skin(parser, "the run's, or ")
    add_talk(parser, "every number")

    pictures = parser.add_argument_group("the pictures")
    pictures.add_argument(
        "--scene", type=Path, metavar="SCENE", help="Mitsuba scene (default: that of the run, or studio)"
    )
    pictures.add_argument(
        "--samples",
        type=count,
        metavar="N",
        help="samples a pixel, 4 to 65536 (default: as many as the change of the pictures needs)",
    )
    pictures.add_argument(
        "--seed",
        type=seed,
        metavar="N",
        help="seed of the random numbers (default: that of the run's pictures, or 0)",
    )
    add_distance(pictures)
    add_mitsuba(pictures)


def run(arguments: argparse.Namespace) -> int:
    paths = [path for path in (arguments.first, arguments.second) if path is not None]
    _check(arguments, paths)
    with contact_errors_name(" and ".join(map(str, paths))):
        content = retouch.compare(
            arguments.first,
            arguments.second,
            arguments.out,
            defines=dict(arguments.defines),
            **given(arguments, "scene", "variant", "model", "skin", "repeats", "samples", "seed", "quiet"),
            **given(arguments, "distance_cm", *LENGTHS),
        )
    if arguments.json:
        print_json(content)
    elif not arguments.quiet:
        from retouch.pages.content import Compared

        console().print(lines_table(lines(Compared.model_validate(content), arguments.verbose)))
    return 0


def _check(arguments: argparse.Namespace, paths: list[Path]) -> None:
    """Refuse what can be refused before anything is loaded. Raises InputError."""
    textures = [find_texture(path) for path in paths if not path.is_dir()]
    for path in textures:
        if not path.is_file():
            raise InputError(f"{path}: no such file")
    if textures:
        check_scales(arguments, textures)
    else:
        for flag, value in (("--size-mm", arguments.size_mm), ("--relief-mm", arguments.relief_mm)):
            if value is not None:
                raise InputError(f"{flag}: is for textures; a run directory knows its own")
        if arguments.height_scale is not None:
            raise InputError("--height-scale: is for textures; a run directory knows its own")
    out = arguments.out
    check_file_to_write(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{out}: -o: the page is HTML; give a name that ends in .html")


def lines(numbers: "Compared", verbose: bool = False) -> Iterator[tuple[str, str]]:
    """What the screen tells: a word and a sentence each; `verbose` adds other measures of the pictures."""
    for side in numbers.sides:
        yield side.name, f"{side.file}, {side.size_mm:g} mm, {side.samples} x {side.rows}"
    means = "" if numbers.places is None else f" (means over {numbers.places.count} places)"
    for name, quantity in QUANTITIES.items():
        values = " and ".join(number(side.values[name]) for side in numbers.sides)
        yield quantity.label, f"{values} {quantity.unit}".rstrip() + means
    shares = " and ".join(f"{100.0 * side.contact_fraction:.0f} %" for side in numbers.sides)
    yield "in contact", f"{shares} of the patch; {GAPS_COUNT}"
    yield "feel", _feel(numbers)
    if (places := numbers.places) is not None and places.jnd_min is not None:
        ends = f"{places.jnd_min:+.2f} to {places.jnd_max:+.2f}"
        yield "", f"{ends} JND over {places.count} places of the finger"
    if (fingers := numbers.fingers) is not None and fingers.jnd_min is not None:
        yield "", other_fingers(fingers, numbers.places is not None)
    if (measured := numbers.measured) is not None and measured.jnd_mean is not None:
        yield "", measured_finger(measured)
    if (look := numbers.look) is None:
        yield "pictures", f"not compared: {numbers.no_look}"
    else:
        yield "pictures", _pictures(look, verbose)
        for name, each in (("DSSIM", look.dssim), ("FLIP", look.flip)):
            values = ", ".join(number(value, 2) for value in each)
            yield name, f"{values} ({', '.join(look.conditions)})"
    yield "page", str(numbers.page)


def _feel(numbers: "Compared") -> str:
    jnd, names = numbers.jnd_apart, (numbers.first.name, numbers.second.name)
    # "A" and "B", but "the result".
    one, other = (f"the {name}" if name.islower() else name for name in names)
    if jnd is None:
        return "one of the two is smooth; ratios to it mean nothing"
    return f"{other} is {jnd_in_words(jnd)} than {one}, {told_apart(jnd)}"


def _pictures(look: "PictureChange", verbose: bool) -> str:
    if look.noise.certainty == "same":
        return look.noise.message
    about = "" if look.noise.certainty == "known" else "about "
    apart = f"{about}{percent(look.change_percent)} of the mean picture apart"
    of_white = f"{percent(look.change_percent_of_white)} of white"
    return f"{apart} (rms {percent(look.change_rms_percent)}); {of_white}" if verbose else apart
