"""`retouch fuzzy`: find the fuzzy skin by which the sides of a filament print feel as wanted.

Finds thickness and point distance of a slicer's classic fuzzy skin, by pressing on computed walls of beads.
Prints the numbers to type in, and writes a copy of the profile with them. Where PrusaSlicer is installed,
PART is sliced five times, because the noise is random, and fingers press on its sides. Tops are not steered:
fuzzy skin changes sides only.

examples:
  retouch fuzzy grip.3mf --profile fine.ini --feel-of gravel
  retouch fuzzy knob.3mf --profile process.json --jnd=-2
"""

import argparse
from pathlib import Path

import retouch
from relief.ground.options import add_options, declared, given
from retouch.commands.options import add, add_out, add_talk, contact_errors_name, report
from retouch.verbs.fuzzy.fuzzy_options import FuzzyOptions


def add_arguments(parser: argparse.ArgumentParser) -> None:
    add(parser, "part PART", "print file, or the name of a bundled object", type=Path)
    text = ".ini of PrusaSlicer or SuperSlicer, or .json of a process of OrcaSlicer or Bambu Studio"
    add(parser, "--profile FILE", text, type=Path, required=True)
    add_out(parser, "NEW_PROFILE", "profile to write (default: FILE with -fuzzy after its name)")
    add_options(parser, FuzzyOptions)
    add_talk(parser, "settings, target and roughness")


def run(arguments: argparse.Namespace) -> int:
    profile = arguments.profile
    out = arguments.out or profile.with_name(f"{profile.stem}-fuzzy{profile.suffix}")
    with contact_errors_name(arguments.part):
        made = retouch.fuzzy(arguments.part, profile, out, **given(arguments, *declared(FuzzyOptions)))
    return report(arguments, made.as_json(), made.lines())
