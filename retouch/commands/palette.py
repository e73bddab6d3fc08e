"""`retouch palette`: make fills for tactile maps and controls that are told apart by touch.

Makes fills that every finger of a range tells apart by roughness, softer and stiffer, with shallower and
deeper receptors: levels of one texture, or several textures, each changed as little as it takes while it
keeps its look. Textures are tiles (`retouch prepare --tile`). Each is tried rougher and smoother first.

examples:
  retouch palette gravel-tile -o runs/gravel-fills
  retouch palette brick-tile grass-tile leather-tile --apart 3 -o runs/map

DIR then holds index.html, tiles/, print/palette.3mf, palette.json and rows/; see the guide's page
"Palettes".

exit status: 0 if fills are as far apart as asked for; 1 if not; 2 for bad input, or more fills than there is
room for; 130 if interrupted, after which the same command goes on.
"""

import argparse
from pathlib import Path

import retouch
from relief.ground.options import given, whole_number
from retouch.commands import options
from retouch.commands.stimuli import AFTER_INTERRUPT as AFTER_INTERRUPT
from retouch.commands.stimuli import COMPLETE, PRINT, WITH_FAILURES, add_print, add_work, settings_of

MOST_FILLS = 16


def add_arguments(parser: argparse.ArgumentParser) -> None:
    options.add(parser, "textures TEXTURE", options.TEXTURE, type=Path, nargs="+")
    options.add_out(parser, "DIR", "folder to write to, or to go on in", required=True)
    text = "just-noticeable differences of 19 %% between any two fills (default: 2, right in 97 of 100 pairs)"
    options.add(parser, "--apart N", text, type=float)
    text = "number of fills (default: one of each texture, or of one texture as many as there is room for)"
    options.add(parser, "--fills N", text, type=whole_number(2, MOST_FILLS))
    text = "the given finger alone tells them apart (default: a range of fingers about it)"
    options.add(parser, "--one-finger", text)
    options.add_plate(parser, side="width of the tile")
    options.add_skin(parser)
    add_print(parser)
    add_work(parser)
    options.add_talk(parser, "the content of palette.json, with the folder,")


def run(arguments: argparse.Namespace) -> int:
    chosen = options.keywords(arguments, retouch.palette) | {"settings": settings_of(arguments)}
    made = retouch.palette(plates=given(arguments, *PRINT), **chosen)
    options.report(arguments, made.as_json(), made.lines())
    return WITH_FAILURES if made.content["short"] else COMPLETE
