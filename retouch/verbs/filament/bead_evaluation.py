"""Evaluation of sliced parts: how G-code is read and pressed, and what is said of it."""

import os
from collections.abc import Iterator
from pathlib import Path

from optimize.verification.solids.bead_feel import BeadFeel, feel_of_beads
from relief.ground.formatting import number
from relief.ground.progress import say
from relief.solids.filament.beads import SlicedPart
from relief.solids.filament.gcode_reader import read_gcode as parsed_gcode

__all__ = ["feel_of_beads", "part_lines", "read_gcode"]


def read_gcode(path: str | os.PathLike[str]) -> SlicedPart:
    """Read the beads of a file of G-code, and print what a reader of its numbers should know.

    Args:
        path: .gcode, .gcode.3mf or .bgcode.

    Raises:
        InputError: the file cannot be read, is cut off, or holds no beads of a part.
    """
    part = parsed_gcode(Path(path))
    for line in part.warnings:
        say(f"{path}: {line}")
    return part


def part_lines(part: SlicedPart, felt: BeadFeel) -> Iterator[str]:
    """A sentence for a person about a sliced part and its places."""
    sides = " x ".join(number(side) for side in felt.sides_mm)
    slicer = f"{part.slicer}, " if part.slicer else ""
    count = len(felt.crops)
    places = "felt at one place" if count == 1 else f"mean over {count} places"
    if felt.crops[0].on_edge:
        places += ", on an edge" if count == 1 else ", all on edges, where a finger feels the shape"
    elif felt.edges:
        places += f"; {felt.edges} on edges are left out"
    yield f"{part.path} ({slicer}{sides} mm): {places}. The part's own curvature is {felt.curvature}."
