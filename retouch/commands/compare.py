"""`retouch compare`: show two textures, results or runs side by side.

Presses the finger on both reliefs and renders both under the same lights. Writes one page that needs no
network: how each feels, how many just-noticeable differences apart the two are, both pictures over one
another to slide or blink between, the change of the pictures, DSSIM and FLIP, profiles, heights and strain.

A run directory stands for its result. One run directory alone: its original beside its result, both as
printed if the run has a printer. Reliefs on plates of two sizes are compared by touch alone.

TEXTURE: {options.TEXTURE}.

examples:
  retouch compare runs/stone
  retouch compare runs/stone runs/stone-2 -o both.html
  retouch compare gravel brick --relief-mm 1.2
  retouch compare stone.exr runs/stone --scene five_views --json
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, cast

from mitsuba_scenes import find_texture
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.run_options import distance_option
from relief.ground.errors import InputError
from relief.ground.files import check_file_to_write
from relief.ground.options import add_option, given
from retouch.commands import options

if TYPE_CHECKING:
    from relief.ground.lengths import Lengths

PAGE = Path("comparison.html")
"""File of the page where no other is given."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    options.add(parser, "first A", "TEXTURE or RUN_DIR", type=Path)
    options.add(parser, "second B", "the same (default: the result of the run A)", type=Path, nargs="?")
    options.add_out(parser, "PAGE", f"file to write (default: {PAGE})", default=PAGE)
    options.add_plate(parser)
    options.add_repeats(parser, "the run's")
    options.add_model(parser)
    options.add_skin(parser, f"the run's, or {DEFAULT_SKIN}")
    options.add_talk(parser, "every number")

    pictures = options.add_pictures(parser)
    text = "seed of the random numbers (default: that of the run's pictures, or 0)"
    options.add(pictures, "--seed N", text, type=options.seed)
    add_option(pictures, "distance_cm", distance_option(), float)


def run(arguments: argparse.Namespace) -> int:
    paths = [path for path in (arguments.first, arguments.second) if path is not None]
    _check(arguments, paths)
    # The packages that press and render take seconds to import.
    from retouch.verbs.comparison import CompareOptions, compared
    from retouch.verbs.subjects import read_subjects

    keywords = options.keywords(arguments, CompareOptions) | {"defines": dict(arguments.defines)}
    chosen = CompareOptions(**keywords)
    lengths = cast("Lengths", given(arguments, *options.LENGTHS))
    with options.contact_errors_name(" and ".join(map(str, paths))):
        subjects = read_subjects(arguments.first, arguments.second, lengths, arguments.repeats)
        numbers = compared(subjects, chosen, arguments.out)
    return options.report(arguments, numbers.as_json(), numbers.lines(arguments.verbose))


def _check(arguments: argparse.Namespace, paths: list[Path]) -> None:
    """Refuse what can be refused before anything is loaded. Raises InputError."""
    textures = [find_texture(path) for path in paths if not path.is_dir()]
    for path in textures:
        if not path.is_file():
            raise InputError(f"{path}: no such file")
    if textures:
        options.check_scales(arguments, textures)
    for name in () if textures else given(arguments, *options.LENGTHS):
        raise InputError(f"--{name.replace('_', '-')}: is for textures; a run directory knows its own")
    out = arguments.out
    check_file_to_write(out)
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{out}: -o: the page is HTML; give a name that ends in .html")
