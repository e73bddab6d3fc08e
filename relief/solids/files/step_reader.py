"""Reader of STEP (ISO 10303-21): triangles of a CAD kernel, with the normals of the exact surface."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

from relief.ground.errors import InputError, require_extra
from relief.ground.formats import MARKED, STEP_MARK
from relief.solids.files.glb_reader import read_glb
from relief.solids.files.parsed_mesh import Parsed

CHILD = Path(__file__).parent / "cascadio_child.py"
FINE_MM = 0.005
"""Largest distance between a facet and the surface, mm, but in large parts: no print shows 5 um."""
LIMIT_S = 300.0
"""Longest time for a file, seconds; one of 100 MB takes a minute."""


def read_step(content: bytes, path: Path) -> Parsed:
    """Read all parts of a STEP file, each at its place, with names, colours and exact normals.

    Raises:
        InputError: The file is no STEP or damaged, takes too much time or memory, or cascadio is missing.
    """
    if STEP_MARK not in content[:MARKED]:
        raise InputError(f"{path}: not a STEP file (ISO 10303-21); heights of a microscope are a texture")
    require_extra("step", "cascadio", path)
    # The kernel may crash or never return on a hostile file.
    command = [sys.executable, "-P", str(CHILD), str(FINE_MM)]
    try:
        child = subprocess.run(command, input=content, capture_output=True, timeout=LIMIT_S, check=False)
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{path}: the CAD kernel takes more than {LIMIT_S:g} s; divide the part") from error
    chord, _, glb = child.stdout.partition(b"\n")
    if child.returncode or not glb:
        ended = f" (exit status {child.returncode})" if child.returncode else ""
        raise InputError(f"{path}: damaged, without solids, or too large for the CAD kernel{ended}")
    line = f"is large: its facets leave out up to {float(chord):.2g} mm where no texture lies"
    return replace(read_glb(glb, path, cad=True), warnings=(line,) if float(chord) > FINE_MM else ())
