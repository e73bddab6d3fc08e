"""`retouch stimuli`: make sets of plates at several levels of feel, for experiments.

Makes plates of 25 mm that look like a texture and feel rougher or smoother by the given numbers of
just-noticeable differences, each verified; 0 is the texture itself. The texture is a tile (`retouch prepare
--tile`), which is optimised once for each level and repeated over the plate, or a plate as a
whole (--whole). Names lie on the backs.

examples:
  retouch stimuli gravel-tile --jnd -2,-1,0,1,2 -o runs/gravel-set
  retouch stimuli gravel-tile knit-tile --jnd -2,-1,0,1,2 --with-scaled -o runs/two-textures
  retouch stimuli weave-tile --jnd 0 --contact-area-scale 0.8,1.2 -o runs/cold
  retouch stimuli bark-tile --jnd -1,0,1 --printer mask-50 -o runs/bark-prints
  retouch stimuli stone.png --jnd 0,2 --source wall.jpg --source-mm 60 -o runs/stone
  retouch stimuli --redraw --bed-mm 192x120 -o runs/gravel-set

DIR then holds index.html (pictures, verified levels, and how often people should tell plates apart), print/
with a 3MF of each texture, experiment/ with the plan of the trials and a page that takes answers, plates.csv,
pairs.csv, stimuli.json, and rows/, the run directories. The guide's page "Statistics of answers" says how
the predictions are made, and "A study with people" how an experiment is run.

exit status: 0 if every plate is done; 1 if some have failed; 2 for bad input; 130 if interrupted. After 1
and 130 the same command goes on.
"""

import argparse
import time
import tomllib
from pathlib import Path
from typing import Any

import retouch
from relief.ground.errors import InputError
from relief.ground.options import given
from retouch.commands import options

COMPLETE, WITH_FAILURES = 0, 1
"""Exit statuses: every plate is done, or some have failed."""
MOST_CONTROLS = 16
MOST_PEOPLE, MOST_PAIRS = 300, 1000

PRINT = ("plate_mm", "base_mm", "bed_mm", "label")
"""Options of `add_print`, by the names of arguments."""
AFTER_INTERRUPT = "; plates that are done stay, and the same command goes on"
"""End of the line that an interrupt prints."""


def numbers(text: str) -> tuple[float, ...]:
    """Read numbers between commas, such as "-2,0,2". Raises argparse.ArgumentTypeError."""
    try:
        return tuple(float(part) for part in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is no list of numbers such as -2,-1,0,1,2") from None


def bed(text: str) -> tuple[float, float]:
    """Read the sides of a bed, such as "120x68". Raises argparse.ArgumentTypeError."""
    parts = text.lower().split("x")
    try:
        width, depth = (float(part) for part in parts)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not two lengths such as 120x68") from None
    return width, depth


def add_arguments(parser: argparse.ArgumentParser) -> None:
    options.add(parser, "textures TEXTURE", options.TEXTURE, type=Path, nargs="*")
    options.add_out(parser, "DIR", "folder to write to, or to go on in", required=True)
    options.add(parser, "--redraw", "compute nothing; draw plates and page of DIR anew")
    what = parser.add_argument_group("the plates")
    text = "levels of roughness, just-noticeable differences of 19 %% from the texture; 0 is the texture"
    options.add(what, "--jnd N,N,...", text, type=numbers)
    text = "levels of contact area in units of the texture's own, which change how cold it feels"
    options.add(what, "--contact-area-scale R,R,...", text, type=numbers)
    text = "levels of contact area keep the texture's roughness (default: they keep its look alone)"
    options.add(what, "--same-roughness", text)
    text = "the texture is no tile, but at least as large as a plate, and is optimised as a whole"
    options.add(what, "--whole", text)
    options.add(what, "--with-scaled", "each level of roughness also by scaling the heights, to compare with")
    text = "picture that the texture was cut from: other patches of it become plates as they are; one for "
    text += "each texture, in their order"
    options.add(what, "--source PICTURE", text, dest="sources", type=Path, action="append", default=[])
    options.add(what, "--source-mm MM", "width of that picture, mm", type=float)
    text = "number of these patches (default: 3)"
    options.add(what, "--controls N", text, type=options.whole_number(1, MOST_CONTROLS))
    text = "each level is felt and seen between prints of this printer, whose pixels plates have"
    options.add_printer(what, text)
    options.add_plate(what, side="width of the tile")
    options.add_skin(what)
    add_print(parser)
    trials = parser.add_argument_group("the experiment")
    text = "people of the plan (default: 8)"
    options.add(trials, "--people N", text, type=options.whole_number(1, MOST_PEOPLE))
    text = "most pairs of each question that a person compares (default: 120, about 20 minutes)"
    options.add(trials, "--pairs N", text, type=options.whole_number(2, MOST_PAIRS))
    options.add(trials, "--seed N", "of the random order of trials (default: 0)", type=options.seed)
    text = "codes in place of the names of plates, on their backs too, so that nobody can read a level"
    options.add(trials, "--codes", text, action="store_true", default=None)
    add_work(parser)
    options.add_talk(parser, "the content of stimuli.json, with the folder and the files written,")


def add_print(parser: argparse.ArgumentParser) -> None:
    """Add `--plate-mm`, `--base-mm`, `--bed-mm` and `--label` (`PRINT`), None where not given."""
    printing = parser.add_argument_group("the print")
    options.add(printing, "--plate-mm MM", "side of a plate, mm (default: 25)", type=float)
    options.add(printing, "--base-mm MM", "thickness under the relief, mm (default: 2)", type=float)
    text = "sides of the printer's bed, mm; more plates than fit make several files (default: 120x68)"
    options.add(printing, "--bed-mm WxD", text, type=bed)
    text = "names on the backs, 0.4 mm high or deep (default: raised)"
    options.add(printing, "--label", text, choices=("raised", "engraved", "none"))


def add_work(parser: argparse.ArgumentParser) -> None:
    """Add `--fast`, `--set`, `--workers` and `--dask`."""
    work = parser.add_argument_group("the work")
    options.add(work, "--fast", "compute each step with the fast models")
    text = "any key of a run file, for every plate; may be given several times"
    options.add(work, "--set KEY=VALUE", text, dest="settings", action="append", default=[])
    options.add_workers(work)


def run(arguments: argparse.Namespace) -> int:
    began = time.monotonic()
    plates = given(arguments, *PRINT)
    experiment = given(arguments, "people", "pairs", "seed", "codes")
    if arguments.redraw:
        _refuse_levels(arguments)
        stimuli = retouch.redraw_stimuli(arguments.out, plates=plates, experiment=experiment)
    else:
        chosen = options.keywords(arguments, retouch.stimuli) | {"settings": settings_of(arguments)}
        stimuli = retouch.stimuli(plates=plates, experiment=experiment, **chosen)
    took = None if arguments.redraw else time.monotonic() - began
    options.report(arguments, stimuli.as_json(), stimuli.lines(took))
    return WITH_FAILURES if stimuli.numbers.failures else COMPLETE


def _refuse_levels(arguments: argparse.Namespace) -> None:
    """Raise InputError for an option that says what a set is, which its folder says already."""
    levels = (arguments.textures, arguments.jnd, arguments.contact_area_scale, arguments.sources)
    switches = (arguments.same_roughness, arguments.whole, arguments.with_scaled, arguments.fast)
    if any(levels) or any(switches) or arguments.settings or arguments.printer:
        raise InputError("--redraw: draws the set in the folder; give -o and options of the print alone")


def settings_of(arguments: argparse.Namespace) -> dict[str, Any]:
    """The settings of `--set` by key. Raises InputError."""
    return {key: value for text in arguments.settings for key, value in _setting(text).items()}


def _setting(text: str) -> dict[str, Any]:
    """Read `--set KEY=VALUE`; bare words count as strings. Raises InputError."""
    key, equals, value = text.partition("=")
    if not equals or not key.strip():
        raise InputError(f"--set {text[:80]}: expected KEY=VALUE, as in descent.steps=20")
    try:
        parsed = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError):
        parsed = {"value": value.strip()}
    if parsed.keys() != {"value"} or not isinstance(parsed["value"], str | int | float | bool):
        raise InputError(f"--set {text[:80]}: one number, word or truth value is expected")
    return {key.strip(): parsed["value"]}
