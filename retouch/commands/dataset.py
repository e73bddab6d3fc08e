"""`retouch dataset`: make a data set to train the learned models on.

Draws a corpus of textures and computes for each how it feels (strain, gap, roughness and contact area, by
finite elements or the elastic layer) and how it looks (pictures under single parallel lights and under
ambient light). The files appear in DIR one by one; after an interruption the same command continues.

examples:
  retouch dataset -o data --count 6300
  retouch dataset -o data --count 6300 --textures ~/materials --optimised runs/optimised
  retouch dataset -o data --count 100000 --touch layer --lights studio --dask tcp://10.0.0.1:8786

The guide's page "Formats, fingers and printers" describes the format.

exit status: 0 if every texture has its fields; 1 if some have none, which failures.jsonl lists.
"""

import argparse
import sys
from pathlib import Path

import retouch
from relief.ground.options import whole_number
from retouch.commands.options import add, add_out, add_talk, add_workers, keywords, print_json, seed

COMPLETE, WITH_FAILURES = 0, 1
"""Exit statuses: every texture has its fields, or some have none."""
MOST_TEXTURES = 10_000_000
MOST_DIRECTIONS = 64
FAILURES = "failures.jsonl"
MOST_SHOWN = 5
"""Most failures that are printed; failures.jsonl lists all."""


AFTER_INTERRUPT = "; the same command goes on"
"""End of the line that an interrupt prints."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add_out(parser, "DIR", "the data set, new or unfinished", required=True)
    textures = parser.add_argument_group("the textures")
    text = "number of textures to draw"
    add(textures, "--count N", text, type=whole_number(1, MOST_TEXTURES), required=True)
    add(textures, "--seed S", "seed of the corpus (default: 0)", type=seed, default=0)
    text = "further height maps to cut textures from, beside scikit-image's photographs; repeatable"
    add(textures, "--textures FOLDER", text, type=Path, action="append", default=[])
    add(textures, "--optimised FOLDER", "optimised textures to add, with their manifest", type=Path)
    fields = parser.add_argument_group("the fields")
    text = "model of touch: fem, finite elements (default); layer, faster; none"
    add(fields, "--touch", text, choices=("fem", "layer", "none"), default="fem")
    text = "random, elevation 10 to 80 degrees (default); studio, its three lights; none, no pictures"
    add(fields, "--lights", text, choices=("random", "studio", "none"), default="random")
    text = "number of random lights of each texture (default: 8)"
    add(fields, "--directions K", text, type=whole_number(1, MOST_DIRECTIONS))
    text = "shadow rays a pixel where light and shadow meet (default: 144)"
    add(fields, "--samples N", text, type=int, default=144)
    work = parser.add_argument_group("the work")
    add_workers(work)
    add_talk(parser, "the number of textures, and those without fields,")


def run(arguments: argparse.Namespace) -> int:
    result = retouch.dataset(**keywords(arguments, retouch.dataset))
    status = WITH_FAILURES if result.failures else COMPLETE
    if arguments.json:
        print_json(result.as_json())
        return status
    if not arguments.quiet:
        complete = result.textures - len(result.failures)
        print(f"{result.folder}: {complete} textures with their fields, {len(result.failures)} without")
    for failure in result.failures[:MOST_SHOWN]:
        print(f"texture {failure.index} ({failure.source}): {failure.reason}", file=sys.stderr)
    if len(result.failures) > MOST_SHOWN:
        print(f"... the others are listed in {result.folder / FAILURES}", file=sys.stderr)
    return status
