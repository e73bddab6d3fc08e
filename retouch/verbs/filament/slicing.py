"""Slicers as programs: a mesh and a profile in, the beads of the G-code out."""

import shutil
import subprocess
import tempfile
from pathlib import Path

from relief.ground.errors import InputError, option_error
from relief.ground.progress import stage
from relief.solids.filament.beads import SlicedPart
from relief.solids.filament.gcode_reader import read_gcode

LONGEST_S = 900.0
"""Longest time that a slicer may take, s: large parts in fine layers take minutes."""
OURS = "post_process =\nbinary_gcode = 0\n"
"""Settings that replace those of a profile: no program is run on the G-code, and the G-code is a text."""


def check_slicer(slicer: str, profile: Path) -> str:
    """The path of a program that slices by a profile's `.ini`, as PrusaSlicer and SuperSlicer do.

    Raises:
        InputError: there is no such program or profile, or the profile is one of OrcaSlicer or Bambu Studio,
            whose command lines take profiles of printer and filament beside it.
    """
    if profile.suffix.lower() == ".json":
        fault = (
            f"{profile} is sliced with profiles of printer and filament only; evaluate the slicer's G-code"
        )
        raise option_error("slicer", fault)
    if not profile.is_file():
        raise InputError(f"{profile}: no such file")
    if (program := shutil.which(slicer)) is None:
        raise option_error("slicer", f"{slicer}: no such program")
    return program


def sliced(slicer: str, mesh: Path, profile: Path) -> SlicedPart:
    """Slice a mesh with PrusaSlicer or SuperSlicer, and read what would be printed.

    Programs that the profile names for after the slicing are not run.

    Args:
        slicer: name of the program, or its path.
        mesh: file that the slicer reads (STL, OBJ, 3MF); the slicer moves it to the middle of the bed.
        profile: configuration (.ini).

    Raises:
        InputError: as of `check_slicer`; or the slicer fails or takes too long, or its G-code cannot be read.
    """
    command = [check_slicer(slicer, profile), "--load", str(profile.absolute())]
    with tempfile.TemporaryDirectory() as folder, stage(f"{Path(slicer).name} slices {mesh.name}"):
        changes, out = Path(folder) / "changes.ini", Path(folder) / f"{mesh.stem}.gcode"
        changes.write_text(OURS)
        command += ["--load", str(changes), "--export-gcode", "-o", str(out), str(mesh.absolute())]
        try:
            done = subprocess.run(command, capture_output=True, cwd=folder, timeout=LONGEST_S)
        except subprocess.TimeoutExpired as error:
            raise InputError(f"{mesh.name}: {slicer} takes more than {LONGEST_S:g} s") from error
        if done.returncode or not out.is_file():
            lines = ["no word", *filter(str.strip, done.stderr.decode(errors="replace").splitlines())]
            last = lines[-1].strip().removeprefix("what():").strip()[:200]
            raise InputError(f"{mesh.name}: {slicer} fails: {last}")
        return read_gcode(out)
